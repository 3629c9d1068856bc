#!/bin/sh
#test: beside
# &anti_locking with levels: a bar is pressed, with the edge of a level at each of the eight places that it can have in a block (at one of
# them a coarse block holds nodes that slaves give to and no particles). Everywhere energy is kept and stresses are those of one level.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"

scene() { # scene EDGE: in cells from the foot; 0: no level
   level=''
   [ "$1" -eq 0 ] || level="&level lower=0,0,0, upper=$1,4,4 /"
   cat <<EOF
&scene title='edge at $1', end_time=3 /
&grid lower=0,0,0, upper=24,4,4, cell_size=1, boundary='symmetry','free','symmetry','symmetry','symmetry','symmetry' /
$level
&material name='m', model='elastic', density=1, young=100, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=20,4,4 /
&pressure lower=20,0,0, upper=20,4,4, times=0,0.2, values=0,1 /
&anti_locking /
&output directory='edge_$1', formats='none' /
EOF
}

balance() { # balance LOG: largest error of the energy balance [%]
   sed -n 's/^energy balance error: .*, \([0-9.]*\) %.*/\1/p' "$1"
}
strain_energy() { # strain_energy DIRECTORY: at the end [J], the third column
   awk 'NR > 3 { last = $3 } END { print last }' "$1/energy.dat"
}

for edge in 0 4 5 6 7 8 9 10 11; do
   scene $edge >edge_$edge.nml
   run_scene 1 edge_$edge.nml edge_$edge.log || { tail -n 5 edge_$edge.log; fail "the scene with its edge at $edge does not end well"; }
done
grep -q '^VARIABLES="time \[s\]", "kinetic \[J\]", "strain \[J\]"' edge_0/energy.dat || fail 'the columns of energy.dat are others'
bad=''
for edge in 0 4 5 6 7 8 9 10 11; do
   off=$(balance edge_$edge.log)
   apart=$(awk -v a="$(strain_energy edge_$edge)" -v b="$(strain_energy edge_0)" 'BEGIN { printf "%.3f", 100*(a/b - 1) }')
   echo "edge at $edge: energy balance error $off %, strain energy $apart % off that of one level"
   awk -v o="$off" -v a="$apart" 'BEGIN { exit !(o > 0 && o < 1 && a*a < 0.25) }' || bad="$bad $edge"
done
[ -z "$bad" ] || fail "energy is not kept within 1 %, or strain energy differs by more than 0.5 %, with the edge at$bad"
