#!/bin/sh
#test: beside
#test: limit 90
# Scenes at the margin of what may be asked for: long arrays, hardly any steps, steps without number, tools faster than the search for
# contact, runs that are at their end; and sentences about effects, which name the line.
. "$(dirname "$0")/../harness/env.sh"

head_of() { # head_of END MORE-OF-&scene
   cat <<EOF
&scene end_time=$1 ${2:-} /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.0625 /
&material name='m', model='elastic', density=1000, young=1e6, poisson=0.3 /
EOF
}
block="&body material='m', shape='box', lower=0.25,0.25,0.25, upper=0.75,0.75,0.5"

refused() { # refused WHAT SENTENCE FILE
   status=0
   "$GIMP3D" <"$3" >refused.log 2>&1 || status=$?
   [ $status -eq 2 ] || { cat refused.log; fail "$1: status $status"; }
   grep -qE -- "$2" refused.log || { cat refused.log; fail "$1: nothing says '$2'"; }
}

# arrays of any length; what is written reads back
{
   head_of 1e-3
   echo "$block /"
   awk 'BEGIN { printf "&tool shape=\"flat\", radius=0.2, tip=0.5,0.5,0.5,\n times="; for (i = 0; i < 6000; i++) printf "%s%.9e", i ? "," : "", i*1.1234567e-6
                printf "\n speeds="; for (i = 0; i < 6000; i++) printf "%s%.9e", i ? "," : "", 0.1 + i*1.2345678e-7; print " /" }'
   echo "&output directory='long', formats='none' /"
} >long.nml
run_scene 1 long.nml || { tail -n 5 run_1.log; fail 'a tool with 6000 times'; }
cp long/case.nml first.nml
run_scene 1 first.nml || fail 'case.nml with 6000 times does not read back'
cmp -s long/case.nml first.nml || fail 'case.nml with 6000 times reads back to other values'

# a plan of a scene that is over in two steps, in which nothing reaches a side
{ head_of 1e-4 ", mode='plan'"; echo "$block, velocity=0,0,-300 /"; } >plan.nml
run_scene 1 plan.nml || { tail -n 5 run_1.log; fail 'the plan of two steps'; }
grep -q '^steps      2 of' run_1.log || fail 'the plan of two steps says another number'

# steps without number, and tools that are faster than the search for contact
{ head_of 0.05; echo "$block / &time time_step=1e-30 /"; } >steps.nml
refused 'steps without number' 'end_time=0.05: would take more than 1e15 steps' steps.nml
{ head_of 0.05; echo "$block / &time time_step=2e-4 / &tool shape='flat', radius=0.2, tip=0.5,0.5,0.6, times=0,1, speeds=0,3000 /"; } >fast.nml
refused 'a tool too fast for the given step' '&time time_step=2e-4: must be at most' fast.nml

{ head_of 0.05; echo "$block / &tool shape='flat', radius=0.2, tip=0.5,0.5,0.9, times=0,1e-6, speeds=0,3000 /"; } >jump.nml
status=0
"$GIMP3D" <jump.nml >jump.log 2>&1 || status=$?
[ $status -eq 3 ] && grep -q 'the tool tool1 moves by more than 0.4 cells in a step; try a smaller step or slower speeds' jump.log ||
   { cat jump.log; fail "a tool whose speed jumps within a step: status $status"; }

# a given step is judged by what tools do within the scene, those that loads push included
{ head_of 1e-3; echo "$block / &time time_step=2e-4 / &tool shape='flat', radius=0.2, tip=0.5,0.5,0.6, times=0,0.5,1, speeds=0,0,3000 /"; } >late.nml
run_scene 1 late.nml || { tail -n 3 run_1.log; fail 'a tool that is too fast after the end of the scene is no fault'; }
{ head_of 0.05; echo "$block / &time time_step=2e-4 /"; echo "&tool shape='flat', radius=0.2, tip=0.5,0.5,0.6, times=0, loads=0, mass=1, initial_speed=3000 /"; } >pushed.nml
refused 'a pushed tool too fast for the given step' 'line 4, &time time_step=2e-4: must be at most' pushed.nml

# a body that no particle's centre lies in
{ head_of 0.01; echo "$block /"; echo "&body material='m', shape='sphere', center=0.5,0.5,0.75, radius=0.02 /"; } >ghost.nml
refused 'a body without particles' "line 5, &body shape='sphere': the body contains no particle centre" ghost.nml

# what an older run left is not taken for the new one's, also where that ends by a fault: its index, its cost.dat
{ head_of 1e-3; echo "$block, velocity=0,0,1 / &output directory='used', every=5e-4 /"; } >older.nml
run_scene 1 older.nml || fail 'a run with snapshots'
grep -q 'particles_.*hdf' used/particles.xdmf || fail 'the index of a run with snapshots names none'
cp used/cost.dat cost_before.dat
sed "s:&output.*:\&output directory='used', formats='none' /:" jump.nml >newer.nml
echo "&output directory='used', formats='none' /" >>newer.nml
status=0
"$GIMP3D" <newer.nml >newer.log 2>&1 || status=$?
[ $status -eq 3 ] || { cat newer.log; fail "a fault in a used directory: status $status"; }
! grep -q 'particles_.*hdf' used/particles.xdmf || fail 'the index still names snapshots of the older run'
[ -e used/cost.dat ] || fail 'a run that ends by a fault has written no cost.dat'
! cmp -s used/cost.dat cost_before.dat || fail 'cost.dat is still that of the older run'
grep -q 'figures of this summary are of the last good state' newer.log || fail 'the summary does not say of which state it is'

# sentences name the line
{ head_of 0.01; echo "$block /"; echo "&pressure lower=0.3,0.3,0.9, upper=0.5,0.5,0.9, times=0, values=1 /"; } >patch.nml
refused 'a patch beside all bodies' 'line 5, &pressure: 0 m2' patch.nml
{ head_of 0.01; echo "$block /"; echo; echo "&damping kind='local', coefficient=0.5 / &tool shape='flat', radius=0.2, tip=0.5,0.5,0.6, times=0, speeds=0 /"; } >local.nml
refused 'local damping with a tool' "line 6, &damping kind='local'" local.nml

# a run at its end, and one that is beyond the end that is asked for
{ head_of 0.01; echo "$block, velocity=1,0,0 / &checkpoint / &output directory='over' /"; } >over.nml
run_scene 1 over.nml || fail 'a run with a checkpoint'
cp over/energy.dat energy_before.dat
"$GIMP3D" --restart over >again.log 2>&1 || { cat again.log; fail 'going on from a run at its end'; }
grep -q '10 ms: the run has reached its end; nothing is left to do' again.log || { cat again.log; fail 'a run at its end does not say so'; }
cmp -s over/energy.dat energy_before.dat || fail 'going on from a run at its end changed energy.dat'
sed "s/end_time=0.01/end_time=0.005, restart='over'/" over.nml >earlier.nml
cp over/case.nml case_before.nml
refused 'an end before the checkpoint' 'end_time=0.005: must be at least 0.01 s, where the run stands in over/checkpoint_' earlier.nml
cmp -s over/case.nml case_before.nml || fail 'a refused scene changed case.nml'

# a log that cannot be written ends the run before it takes an older run's checkpoints away
rm over/run.log
mkdir over/run.log
status=0
"$GIMP3D" <over.nml >unwritable.log 2>&1 || status=$?
[ $status -eq 4 ] || { cat unwritable.log; fail "run.log cannot be written: status $status"; }
ls over/checkpoint_*.h5 >/dev/null 2>&1 || fail 'the checkpoints are gone though the run could not begin'
