#!/bin/sh
# What the closing summary and the head of cost.dat say a run is worth (worth.py): a ball is pressed on a block that nothing holds, on
# one level and on two, so that the change of momentum must be the impulse of the tool; and on one that stands on a roller.
#test: limit 100
. "$(dirname "$0")/../harness/env.sh"
scene() { # scene NAME BOUNDARY GROUPS
   cat >"$1.nml" <<END
&scene    title='$1', end_time=6e-3 /
&grid     lower=0,0,0, upper=1.6,1.6,1.2, cell_size=0.1, boundary=$2 /
&material name='rubber', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body     material='rubber', shape='box', lower=0.4,0.4,0.0, upper=1.2,1.2,0.6, velocity=0.1,0.2,0.3 /
&tool     name='ball', shape='sphere', radius=0.5, tip=0.8,0.8,0.6, times=0, speeds=4, friction=0.2 /
&output   directory='$1' /
$3
END
   run_scene 2 "$1.nml" "$1.log" || fail "$1 ended with status $?: $(tail -n 3 "$1.log")"
}
sides="'free','free','free','free','free','free'"
scene held "'free','free','free','free','roller','free'" ''
scene free "$sides" ''
sed -i 's/lower=0.4,0.4,0.0, upper=1.2,1.2,0.6/lower=0.4,0.4,0.2, upper=1.2,1.2,0.8/; s/tip=0.8,0.8,0.6/tip=0.8,0.8,0.8/' free.nml
run_scene 2 free.nml free.log
sed "s/'free', end/'levels', end/; s/directory='free'/directory='levels'/" free.nml >levels.nml
echo "&level lower=0.3,0.3,0.3, upper=1.4,1.4,1.2 /" >>levels.nml
run_scene 2 levels.nml levels.log || fail "levels: $(tail -n 3 levels.log)"
sed "s/'free', end/'fallen', end/; s/directory='free'/directory='fallen'/" free.nml >fallen.nml
echo "&gravity acceleration=0,0,-9.81 /" >>fallen.nml
run_scene 2 fallen.nml fallen.log || fail "fallen: $(tail -n 3 fallen.log)"
"$PYTHON" "$ROOT/test/regression/worth.py"
