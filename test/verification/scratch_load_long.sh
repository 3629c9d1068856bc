#!/bin/sh
# A cone that is dragged through an alloy at constant normal load (input/scratch_load.nml).
#test: long
#test: limit 1200
. "$(dirname "$0")/../harness/env.sh"
sed 's:out/scratch_load:scratch_load:' "$ROOT/input/scratch_load.nml" >scratch_load.nml
run_scene 1 scratch_load.nml || fail "$(tail -n 3 run_1.log)"
"$PYTHON" "$ROOT/test/verification/scratch_load.py"
