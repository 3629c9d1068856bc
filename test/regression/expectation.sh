#!/bin/sh
# What a run expects of itself where its tool touches nothing for the first half of the scene: steps in which all is at rest tell
# nothing of those to come, and are not to be what it expects.
#test: limit 100
. "$(dirname "$0")/../harness/env.sh"

cat >late.nml <<'SCENE'
&scene    title='a tool that comes late', end_time=2.4e-8 /
&grid     lower=0,0,0, upper=24e-6,24e-6,16e-6, cell_size=1e-6,
          boundary='symmetry','free','symmetry','free','roller','free' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body     material='aluminium', shape='box', lower=0,0,0, upper=22e-6,22e-6,12e-6, particles_per_cell=8 /
&tool     name='sphere', shape='sphere', radius=10e-6, tip=0,0,13.2e-6, axis=0,0,-1, times=0, speeds=100 /
&output   directory='out', formats='none' /
SCENE
for n in 1 2; do
   run_scene $n late.nml late.log || fail "on $n: status $?: $(tail -n 3 late.log)"
   grep '^estimate at step' late.log || fail "on $n: no word of what was expected: $(tail -n 30 late.log)"
   # it is made of steps after those at rest: the tool touches after 12 of 24 ns
   steps=$(sed -nE 's/^estimate at step ([0-9]+):.*/\1/p; s/^([0-9]+) steps to .*/\1/p' late.log | sort -n | tr '\n' ' ')
   echo "   on $n: expected at step, steps: $steps"
   echo "$steps" | awk 'NF != 2 { exit 1 } { exit !($1 >= 0.5*$2 && $1 < 0.9*$2) }' ||
      fail "on $n the run told its time from steps in which all was at rest: $steps"
done
