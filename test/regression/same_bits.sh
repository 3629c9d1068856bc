#!/bin/bash
#test: beside
#test: limit 180
# A scene without contact, with and without effects, gives the same bits of every output on 1 and 4 ranks, also where particles are
# split; with other RANKS on those, and with boxes too (same_bits_long.sh).   same_bits.sh [RANKS]
. "$(dirname "$0")/../harness/env.sh"
scenes=$ROOT/test/regression
export COMPARED=${*:-4} DOMAINS=corners
if [ $# -gt 0 ]; then DOMAINS='stretch corners'; fi
for n in 1 $COMPARED; do
   sed "s:'out':'usl_$n':" "$scenes/same_bits.nml" >scene.nml
   run_scene $n scene.nml || { cat run_$n.log; fail "on $n ranks"; }
done
for n in 1 $COMPARED; do
   {
      sed "s/safety=0.35/safety=0.35, stress_update='musl'/; s:'out':'effects_$n':" "$scenes/same_bits.nml"
      echo "&gravity acceleration=0.5,-1,-2 / &damping kind='local', coefficient=0.1 / &anti_locking /"
   } >scene.nml
   run_scene $n scene.nml || { cat run_$n.log; fail "with effects on $n ranks"; }
done
for domain in $DOMAINS; do
   for n in 1 $COMPARED; do
      sed "s/domain='corners'/domain='$domain'/; s:'out':'${domain}_$n':" "$scenes/flying_apart.nml" >scene.nml
      run_scene $n scene.nml || { cat run_$n.log; fail "on $n ranks"; }
   done
done
for n in 1 $COMPARED; do
   sed "s:'out':'mirrors_$n':" "$scenes/same_bits_mirrors.nml" >scene.nml
   run_scene $n scene.nml || { cat run_$n.log; fail "between mirrors on $n ranks"; }
done
"$PYTHON" - <<'END'
import os

from runs import *

compared = os.environ["COMPARED"].split()
most = compared[-1]

for update in ("usl", "effects"):
    for ranks in compared:
        same_bits(f"{update}_1", f"{update}_{ranks}")
    first, last = snapshots(f"{update}_{most}")[0], snapshots(f"{update}_{most}")[-1]
    way = last.fields["position"][np.argsort(last.ids)] - first.fields["position"][np.argsort(first.ids)]
    way = np.linalg.norm(way, axis=1).mean() / 0.1
    print(f"   {update}: the particles moved {way:.1f} cells on average")
    require(f"{update}: particles changed block", way > 4)
for ranks in compared:
    same_bits("mirrors_1", f"mirrors_{ranks}")
history = energy(f"effects_{most}")
require("effects: work and damped energy", abs(history["external_work"][-1]) > 50 and history["damped"][-1] > 100)
for domain in os.environ["DOMAINS"].split():
    for ranks in compared:
        same_bits(f"{domain}_1", f"{domain}_{ranks}")
    first, last = snapshots(f"{domain}_{most}")[0], snapshots(f"{domain}_{most}")[-1]
    print(f"   {domain}: {first.ids.size} particles became {last.ids.size}")
    require(f"{domain}: particles were split", last.ids.size > 2 * first.ids.size)
    require(f"{domain}: ids are unique", np.unique(last.ids).size == last.ids.size)
    history = energy(f"{domain}_{most}")
    momentum = vector(history, "momentum")
    check(f"{domain}: change of the sum of masses, relative", history["mass"] / history["mass"][0] - 1, 1e-13)
    check(f"{domain}: change of momentum, relative", (momentum - momentum[0]) / np.linalg.norm(momentum[0]), 1e-12)
# what compares bits must see one
import h5py, shutil
shutil.copytree("usl_1", "planted")
with h5py.File(sorted(Path("planted").glob("particles_*.hdf"))[-1], "r+") as file:
    file["VTKHDF/Points"][5, 1] = np.nextafter(file["VTKHDF/Points"][5, 1], 9)
import checks, io, contextlib
before = len(checks.faults)
with contextlib.redirect_stdout(io.StringIO()):
    same_bits("usl_1", "planted")
caught = len(checks.faults) > before
del checks.faults[before:]
require("one changed bit is noticed", caught)
finish()
END
