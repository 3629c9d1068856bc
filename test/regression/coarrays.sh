#!/bin/bash
#test: long
#test: limit 1800
# The halo filled by coarrays (make HALO=coarray, in a build of its own): unit/exchange and regression/same_bits on 1, 2 and 4 images, and
# on 4, with levels too, the bits of the program that fills it by MPI.
. "$(dirname "$0")/../harness/env.sh"
if ! pkg-config --exists caf-openmpi; then
   echo 'left out: OpenCoarrays for Open MPI is not there (apt-get install libcoarrays-openmpi-dev)'
   exit 0
fi
export OMPI_MCA_osc="${OMPI_MCA_osc:-pt2pt}"
mode=${BUILD%_coarray}
coarrays=build/${mode}_coarray
make -C "$ROOT" -s BUILD="$mode" HALO=coarray "$coarrays/gimp3d" "$coarrays/test/unit/exchange" || fail 'it cannot be built'
for n in 1 2 4; do
   mpirun -n $n "$ROOT/$coarrays/test/unit/exchange" || fail "unit/exchange on $n images"
done
env -u GIMP3D BUILD="${mode}_coarray" bash "$ROOT/test/regression/same_bits.sh" || fail 'regression/same_bits'
for scene in same_bits same_bits_levels; do
   for folder in "$mode" "${mode}_coarray"; do
      GIMP3D=$ROOT/build/$folder/gimp3d
      sed "s:'out':'${scene}_$folder':" "$ROOT/test/regression/$scene.nml" >scene.nml
      run_scene 4 scene.nml || { cat run_4.log; fail "$scene, $folder"; }
   done
done
"$PYTHON" -c "
from runs import *
for scene in ('same_bits', 'same_bits_levels'):
    same_bits(f'{scene}_$mode', f'{scene}_${mode}_coarray')
finish()"
