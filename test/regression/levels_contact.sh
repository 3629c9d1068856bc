#!/bin/sh
# Contact is for the finest level: a tool that reaches a particle of a coarser one, or presses at its edge, ends the run with status 3 and
# a sentence that says where contact is allowed.
. "$(dirname "$0")/../harness/env.sh"
# On several ranks one of them sees it, and the others must not wait for it in the steps of the finer level.
try() { # try NAME LOWER UPPER SENTENCE
   cat >"$1.nml" <<END
&scene title='$1', end_time=1e-8 /
&grid lower=0,0,0, upper=61.44e-6,61.44e-6,38.4e-6, cell_size=2.56e-6, boundary='symmetry','free','symmetry','free','roller','free' /
&level lower=$2, upper=$3 /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='box', lower=0,0,0, upper=56.32e-6,56.32e-6,30.72e-6, particles_per_cell=1 /
&tool name='ball', shape='sphere', radius=6.4e-6, tip=0,0,30.72e-6, axis=0,0,-1, times=0,2.9e-9, speeds=0,150.8 /
END
   status=0
   "$GIMP3D" <"$1.nml" >"$1.log" 2>&1 || status=$?
   [ $status -eq 3 ] || fail "$1 ended with status $status: $(tail -n 3 "$1.log")"
   grep -q "$4" "$1.log" || fail "$1 says: $(grep stopped "$1.log")"
   grep -q 'contact is allowed inside the finest level, (' "$1.log" || fail "$1 does not say where contact is allowed"
   echo "   $(grep -o 'the tool ball.*' "$1.log" | head -n 1)"
   for ranks in 2 3; do
      status=0
      timeout $((30 * ${SLOWER:-1})) mpirun -n $ranks "$GIMP3D" <"$1.nml" >"$1.$ranks.log" 2>&1 || status=$?
      [ $status -eq 3 ] || fail "$1 ended on $ranks ranks with status $status: $(tail -n 3 "$1.$ranks.log")"
      grep -q "$4" "$1.$ranks.log" || fail "$1 says on $ranks ranks: $(grep stopped "$1.$ranks.log")"
   done
}
try beside 20.48e-6,20.48e-6,10.24e-6 40.96e-6,40.96e-6,38.4e-6 'the tool ball touches particle [0-9]* at (.*) m, on level 1'
try below 0,0,5.12e-6 12.8e-6,12.8e-6,20.48e-6 'the tool ball touches particle [0-9]* at (.*) m, on level 1'
