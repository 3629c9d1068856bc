#!/bin/sh
# A cone that is dragged through an alloy (input/scratch.nml): loads are steady over the last half of the way, their ratio is that of
# ploughing, a groove and pile-up stay behind. Its beginning mirrored, and on 1, 2 and 4 ranks, is the same.
#test: long
#test: limit 1800
. "$(dirname "$0")/../harness/env.sh"
sed 's:out/scratch:scratch:' "$ROOT/input/scratch.nml" >scratch.nml
run_scene 1 scratch.nml || fail "$(tail -n 3 run_1.log)"
sed "s/end_time=4.9e-7/end_time=7e-8/; s:every=1e-7:every=1e-7, history_every=1e-10:" "$ROOT/input/scratch.nml" >short.nml
echo '&contact tolerance=1e-11 /' >>short.nml # runs are the same to what the contact problems are solved to
for n in 1 2 4; do
   sed "s:out/scratch:short_$n:" short.nml >"short_$n.nml"
   run_scene "$n" "short_$n.nml" || fail "$(tail -n 3 "run_$n.log")"
done
sed -e 's:out/scratch:short_mirrored:; s/lower=0,-10e-6,0, upper=54e-6/lower=-54e-6,-10e-6,0, upper=0/; s/tip=9e-6/tip=-9e-6/' \
    -e 's/axis=1,0,0/axis=-1,0,0/' short.nml >short_mirrored.nml
run_scene 1 short_mirrored.nml || fail "$(tail -n 3 run_1.log)"
"$PYTHON" "$ROOT/test/verification/scratch.py"
