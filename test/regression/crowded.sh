#!/bin/bash
#test: limit 60
# A run on more ranks than cores says so, and only such a run.
. "$(dirname "$0")/../harness/env.sh"
sed "s:'out':'run':; s:end_time=0.3:end_time=0.01:" "$ROOT/test/regression/free_flight.nml" >scene.nml
cores=$(nproc)
warning="^warning    [0-9]+ ranks share [0-9]+ core\(s\): "
for ranks in 1 $cores $((cores + 1)); do
   run_scene $ranks scene.nml ranks_$ranks.log || { cat ranks_$ranks.log; fail "status on $ranks ranks"; }
done
if grep -E "$warning" ranks_1.log ranks_$cores.log; then fail 'a warning where every rank has a core'; fi
grep -E "$warning" ranks_$((cores + 1)).log | grep -F "$((cores + 1)) ranks share $cores core(s): " ||
   { cat ranks_$((cores + 1)).log; fail "no warning of $((cores + 1)) ranks on $cores cores"; }
if command -v taskset >/dev/null; then # allowed on one core only
   one=$(taskset -pc $$ | sed 's/.*: //; s/[-,].*//')
   taskset -c "$one" mpirun --bind-to none -n 2 "$GIMP3D" <scene.nml >pinned.log || { cat pinned.log; fail 'status on one core'; }
   grep -F '2 ranks share 1 core(s): ' pinned.log || { cat pinned.log; fail 'no warning of 2 ranks on one core'; }
fi
