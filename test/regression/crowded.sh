#!/bin/bash
#test: limit 60
# A run on more ranks than cores says so, and only such a run: here on one core.
. "$(dirname "$0")/../harness/env.sh"
sed "s:'out':'run':; s:end_time=0.3:end_time=0.01:" "$ROOT/test/regression/free_flight.nml" >scene.nml
core=$(taskset -pc $$ | sed 's/.*: //; s/[-,].*//') # the first that is allowed
warning="^warning    "
for ranks in 1 2; do
   taskset -c "$core" mpirun --bind-to none -n $ranks "$GIMP3D" <scene.nml >pinned_$ranks.log ||
      { cat pinned_$ranks.log; fail "status of $ranks ranks on one core"; }
done
if grep "$warning" pinned_1.log; then fail 'a warning where the rank has a core'; fi
grep "$warning" pinned_2.log | grep -F ' 2 ranks share 1 core(s) ' || { cat pinned_2.log; fail 'no warning of 2 ranks on one core'; }
run_scene 1 scene.nml free.log
if grep "$warning" free.log; then fail 'a warning where the rank has all cores'; fi
