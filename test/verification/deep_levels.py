"""A rubber block, one particle a cell, that sags under gravity, with four levels in its lowest corner. It
bulges until particles on every level are too long and are split: on the finest one too, where ids have been
used for twelve splits before the first step. What must hold: the run ends, ids are unique, parts tell their
first parent, mass is exact. usage: deep_levels.py (in an empty directory; GIMP3D is the program)"""

from pathlib import Path

import h5py
import numpy as np
from run_scene import run
from checks import finish, require
from runs import snapshots

SCENE = """&scene title='five levels', end_time=0.8 /
&grid lower=0,0,0, upper=8,8,8, cell_size=1, boundary='symmetry','free','symmetry','free','symmetry','free' /
&level lower=0,0,0, upper=4,4,4 /
&level lower=0,0,0, upper=2.5,2.5,2.5 /
&level lower=0,0,0, upper=1.5,1.5,1.5 /
&level lower=0,0,0, upper=0.5,0.5,0.5 /
&material name='rubber', model='neo_hookean', density=1, young=100, poisson=0.4 /
&body material='rubber', shape='box', lower=0,0,0, upper=6,6,6, particles_per_cell=1 /
&gravity acceleration=0,0,-4 /
&output directory='deep', every=0.8, formats='hdf5' /
"""

run(SCENE, 1)
first, last = snapshots("deep")[0], snapshots("deep")[-1]
with h5py.File(sorted(Path("deep").glob("particles_*.hdf"))[-1]) as file:
    bits = int(file["VTKHDF/PointData/id"].attrs["first_bits"])
parts = (1 << bits) - 1
finest = last.fields["level"].ravel() == 5
print(f"   {len(first.ids)} particles, {len(last.ids)} at the end, {finest.sum()} on level 5, {bits} bits")
require("particles are on all five levels", set(last.fields["level"].ravel()) == {1, 2, 3, 4, 5})
# twelve bits tell the way to level 5, each further one is of a split there
split = last.ids[finest] >> (bits + 12) > 0
require(f"particles on level 5 are split ({split.sum()})", split.sum() > 20)
require("ids are unique", len(set(last.ids)) == len(last.ids))
require("parts tell their first parent", set(last.ids & parts) == set(first.ids & parts))
mass = [one.fields["mass"].sum() for one in (first, last)]
require(f"mass is kept ({mass[1] / mass[0] - 1:.1e})", abs(mass[1] / mass[0] - 1) < 1e-13)
whole = {}
for number, one in zip(last.ids & parts, last.fields["mass"].ravel()):
    whole[number] = whole.get(number, 0.0) + one
require("parts have the mass of their parent", np.allclose(list(whole.values()), 1.0, rtol=1e-13))
finish()
