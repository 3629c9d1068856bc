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
   grep '^expected at step' late.log || fail "on $n: no word of what was expected: $(tail -n 30 late.log)"
   # 'it took N % more' or 'less' than expected
   off=$(sed -nE 's/^expected at step .* in all; it took (\S+) % (more|less) and .*/\1 \2/p' late.log)
   echo "$off" | awk 'NF != 2 { exit 1 } $2 == "more" { exit !($1 <= 100) } { exit !($1 <= 50) }' ||
      fail "on $n the run took more than twice, or less than half, of what it expected: $off (% of that)"
done
