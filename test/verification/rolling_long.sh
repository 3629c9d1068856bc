#!/bin/sh
# A plate between turning rolls (input/rolling.nml): it is taken in, the thickness behind the rolls is that of the gap, speed times
# thickness is the same before and behind, force and moment are those of slab theory. With a friction that is too small for the bite
# the rolls do not take it.
#test: long
#test: limit 600
. "$(dirname "$0")/../harness/env.sh"
sed 's:out/rolling:rolling:' "$ROOT/input/rolling.nml" >rolling.nml
run_scene 1 rolling.nml || fail "$(tail -n 3 run_1.log)"
sed 's:out/rolling:refused:; s/friction=0.2/friction=0.05/; s/velocity=20,0,0/velocity=2,0,0/; s/end_time=2.6e-3/end_time=1e-3/' "$ROOT/input/rolling.nml" >refused.nml
run_scene 1 refused.nml || fail "$(tail -n 3 run_1.log)"
"$PYTHON" "$ROOT/test/verification/rolling.py"
