#!/bin/bash
#test: long
#test: limit 1800
# The halo filled by coarrays (make HALO=coarray, in a build of its own): unit/exchange and regression/same_bits on 1, 2 and 4 images, and
# the bits of the program that fills it by MPI.
. "$(dirname "$0")/../harness/env.sh"
if ! pkg-config --exists caf-openmpi; then
   echo 'left out: OpenCoarrays for Open MPI is not there (apt-get install libcoarrays-openmpi-dev)'
   exit 0
fi
mode=${BUILD%_coarray}
folder=build/${mode}_coarray
make -C "$ROOT" -s BUILD="$mode" HALO=coarray "$folder/gimp3d" "$folder/test/unit/exchange" || fail 'it cannot be built'
for n in 1 2 4; do
   mpirun -n $n "$ROOT/$folder/test/unit/exchange" || fail "unit/exchange on $n images"
done
env -u GIMP3D BUILD="${mode}_coarray" bash "$ROOT/test/regression/same_bits.sh" || fail 'regression/same_bits'
for program in "$ROOT/build/$mode/gimp3d" "$ROOT/$folder/gimp3d"; do
   GIMP3D=$program
   sed "s:'out':'$(basename "$(dirname "$program")")':" "$ROOT/test/regression/same_bits.nml" >scene.nml
   run_scene 2 scene.nml || { cat run_2.log; fail "$program"; }
done
PYTHONPATH=$ROOT/test/regression "$PYTHON" -c "
from runs import *
same_bits('$mode', '${mode}_coarray')
finish()"
