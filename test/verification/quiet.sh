#!/bin/sh
#test: beside
# No alarm where nothing is wrong: energies of round-off, one fixed particle a cell under little tension. And one where much is.
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
cat >still.nml <<'END'
&scene title='two blocks at rest, bonded, nothing moves', end_time=1 /
&grid lower=0,0,0, upper=6,6,8, cell_size=1 /
&material name='m', model='elastic', density=1, young=1000, poisson=0.3 /
&body name='a', material='m', shape='box', lower=1,1,1, upper=5,5,3, contact_group='a' /
&body name='b', material='m', shape='box', lower=1,1,3, upper=5,5,5, contact_group='b' /
&body_contact groups='a','b', bond_strength=1, adhesion=0.1 /
END
"$GIMP3D" <still.nml >still.log || fail "$(tail -3 still.log)"
if grep 'WARNING' still.log; then fail 'at rest'; fi
for pull in 0.1 30; do # of a modulus of 1346
   cat >pulled.nml <<END
&scene title='a block of one fixed particle a cell, pulled', end_time=0.5 /
&grid lower=0,0,0, upper=3,3,9, cell_size=1, boundary='symmetry','free','symmetry','free','symmetry','free' /
&time domain='fixed' /
&material name='m', model='elastic', density=1, young=1000, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=2,2,5, particles_per_cell=1 /
&pressure lower=0,0,5, upper=2,2,5, times=0,0.2, values=0,-$pull /
&damping kind='viscous', coefficient=5 /
END
   "$GIMP3D" <pulled.nml >"pulled_$pull.log" || fail "$(tail -3 "pulled_$pull.log")"
done
if grep '^range ' pulled_0.1.log; then fail 'a tension of 1e-4'; fi
grep -q '^range .*bear a tension of' pulled_30.log || fail 'a tension of 0.02 is not said'
