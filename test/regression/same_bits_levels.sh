#!/bin/bash
#test: long
#test: beside
#test: limit 240
# A scene with nested levels, particles splitting into eight at their edges, gives the same bits of every output on 1, 2 and 4 ranks:
# subcycled and in lockstep, with domains that follow, and with effects.
. "$(dirname "$0")/../harness/env.sh"
scenes=$ROOT/test/regression
try() { # try NAME SED-SCRIPT [MORE GROUPS]
   for n in 1 2 4; do
      { sed "$2; s:'out':'$1_$n':" "$scenes/same_bits_levels.nml"; echo "${3:-}"; } >scene.nml
      run_scene $n scene.nml || { cat run_$n.log; fail "$1 on $n ranks"; }
   done
}
# a level of two parts, a box and a shell
try plain "s/safety=0.35/safety=0.35, transfer='plain', flip_fraction=0.99/; s:^&level lower=0.9.*:&\n&level of=1, shape='sphere', center=3.6,1.2,1.2, radius=0.7, inner_radius=0.25 /:"
# two levels that the estimated error places
try lockstep "s/safety=0.35/safety=0.35, subcycle=.false./; s/end_time=0.2/end_time=0.05/; s/2.1,1.8,1.6 /2.1,1.8,1.6, criterion='error', max_cells=3000 /; s/1.8,1.6,1.3 /1.8,1.6,1.3, criterion='error', max_cells=3000 /"
# a level that a criterion moves over and off stressed material, with means over cells that are joined at its edges
try moving "s/upper=2.1,1.8,1.6 /upper=2.1,1.8,1.6, criterion='stress', max_cells=3000 /; /lower=1.2,1.1/d; s/end_time=0.2/end_time=0.12/" \
   "&anti_locking /"
try corners "s/domain='fixed'/domain='corners'/; s/end_time=0.2/end_time=0.1/" \
   "&gravity acceleration=0.5,-1,-2 / &damping kind='local', coefficient=0.1 / &anti_locking /"
"$PYTHON" - <<'END'
from runs import *

for name in ("plain", "lockstep", "moving", "corners"):
    for ranks in (2, 4):
        same_bits(f"{name}_1", f"{name}_{ranks}")
    first, last = snapshots(f"{name}_4")[0], snapshots(f"{name}_4")[-1]
    print(f"   {name}: {first.ids.size} particles became {last.ids.size}")
    require(f"{name}: particles were split", last.ids.size > 1.5 * first.ids.size)
    require(f"{name}: ids are unique", np.unique(last.ids).size == last.ids.size)
    history = energy(f"{name}_4")
    momentum = vector(history, "momentum")
    check(f"{name}: change of the sum of masses, relative", history["mass"] / history["mass"][0] - 1, 1e-13)
    if name != "corners":
        check(f"{name}: change of momentum, relative", (momentum - momentum[0]) / np.linalg.norm(momentum[0]), 1e-12)
finish()
END
