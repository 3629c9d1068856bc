#!/bin/bash
#test: beside
#test: limit 120
# Free flight and spin, affine and plain: what is conserved, how far the rest drifts, and that no stress comes from nothing.
. "$(dirname "$0")/../harness/env.sh"
scenes=$ROOT/test/regression
for scene in free_flight spin; do
   for transfer in affine plain; do
      name=${scene}_$transfer
      sed "s/transfer='affine'/transfer='$transfer'/; s:'out':'$name':" "$scenes/$scene.nml" >"$name.nml"
      { run_scene 1 "$name.nml" "$name.log" || { cat "$name.log"; touch failed; }; } &
   done
   wait
done
[ ! -e failed ] || fail 'a run'
"$PYTHON" - <<'END'
import numpy as np
from runs import *

young, density, speed, radius = 1e6, 1000.0, 2 * np.pi, 0.4
for transfer in ("affine", "plain"):
    run = f"free_flight_{transfer}"
    history = conserved(run, of_mass=1e-13, of_momentum=1e-12, of_angular=1e-12)
    check(f"{run}: change of kinetic energy, relative", history["kinetic"] / history["kinetic"][0] - 1, 1e-12)
    check(f"{run}: largest stress over Young's modulus", stress(run) / young, 1e-11)
    first, last = snapshots(run)[0], snapshots(run)[-1]
    a, b = (np.argsort(one.ids) for one in (first, last))
    moved = last.fields["position"][b] - first.fields["position"][a] - last.time * first.fields["velocity"][a]
    check(f"{run}: particles off their straight way, in cells", moved / 0.1, 1e-10)
# In two turns of bodies 8 particles thick. Twice the particles along an edge make the drifts 9 (affine) and 4 (plain) times smaller.
for transfer, of_angular, of_energy in (("affine", 0.02, 0.04), ("plain", 0.25, 0.4)):
    run = f"spin_{transfer}"
    history = conserved(run, of_mass=1e-13, of_momentum=1e-12, of_angular=of_angular)
    whole = history["kinetic"] + history["strain"]
    check(f"{run}: change of energy, relative", whole / whole[0] - 1, of_energy)
    check(f"{run}: largest stress over density (speed of the rim)^2", stress(run) / (density * (speed * radius) ** 2), 2.0)
finish()
END
