"""A nearly incompressible block (nu = 0.49) under a patch of pressure, at rest, its lattice aside of the
grid's: in the coarse cells on both sides of a level's edge the particles' own pressures scatter little, and
their means are those of one level. The same without anti-locking must fail. Over the cells of each particle's
own level instead of the composite ones they scatter by 1.6 of their size (theory.md, Cells of anti-locking at
an edge)."""

import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

GIMP3D = sys.argv[1]
LEVEL = "&level lower=4,4,5, upper=10,10,12 /"
SCENE = """&scene title='pressed patch', end_time=3 /
&grid lower=0,0,0, upper=14,14,12, cell_size=1, boundary='free','free','free','free','roller','free' /
{level}
&material name='m', model='elastic', density=1, young=100, poisson=0.49 /
&body material='m', shape='box', lower=1.91,1.91,0, upper=11.91,11.91,10, particles_per_cell=8 /
&pressure lower=4.91,4.91,10, upper=8.91,8.91,10, times=0,0.5, values=0,1 /
&damping kind='viscous', coefficient=3 /
&anti_locking kind='{kind}' /
&output directory='{name}', formats='hdf5' /
"""


def cells(name, level, kind="volumetric"):
    """Mean pressure (Pa) and its scatter about that, by cell of the grid."""
    shutil.rmtree(name, ignore_errors=True)
    done = subprocess.run(
        [GIMP3D], input=SCENE.format(name=name, level=level, kind=kind), text=True, capture_output=True
    )
    if done.returncode:
        sys.exit(f"{name} ends with status {done.returncode}: {done.stderr}")
    with h5py.File(sorted(Path(name).glob("particles_*.h5"))[-1]) as file:
        group = file["VTKHDF"]
        cell = np.floor(group["Points"][:]).astype(int) @ [1, 100, 10000]
        pressure = -group["PointData/stress"][:][:, :3].sum(axis=1) / 3
        volume = group["PointData/volume"][:].ravel()
    keys, which = np.unique(cell, return_inverse=True)
    total = np.bincount(which, volume)
    mean = np.bincount(which, volume * pressure) / total
    scatter = np.sqrt(np.maximum(np.bincount(which, volume * pressure**2) / total - mean**2, 0))
    return {key: (m, s) for key, m, s in zip(keys, mean, scatter)}


def beside_the_edge(key):
    place = np.array([key % 100, key // 100 % 100, key // 10000]) + 0.5
    if place[2] > 9 or (place[:2] < 2.5).any() or (place[:2] > 11).any():  # at the body's surface
        return False
    around = place + np.array(list(np.ndindex(3, 3, 3))) - 1
    inside = (around[:, :2] > 4).all(axis=1) & (around[:, :2] < 10).all(axis=1) & (around[:, 2] > 5)
    return 0 < inside.sum() < 27


def compare(name, reference, kind):
    found = cells(name, LEVEL, kind)
    keys = [key for key in found if beside_the_edge(key)]
    level = np.sqrt(np.mean([reference[key][0] ** 2 for key in keys]))
    off = np.sqrt(np.mean([(found[key][0] - reference[key][0]) ** 2 for key in keys])) / level
    scatter = np.sqrt(np.mean([found[key][1] ** 2 for key in keys])) / level
    print(
        f"   {name}: {len(keys)} cells, rms pressure {level:.3g} Pa; means off {100 * off:.2f} %, scatter "
        f"{100 * scatter:.2f} % of it"
    )
    return off, scatter


one_level = cells("one", "")
off, scatter = compare("joined", one_level, "volumetric")
_, unmended = compare("locking", one_level, "none")
if not (off < 0.15 and scatter < 0.1 * unmended):
    sys.exit(
        "means beside the edge are not those of one level within 15 %, or pressures scatter by more than a "
        "tenth of those without anti-locking"
    )
if not unmended > 1:
    sys.exit(
        "the control does not fail: without anti-locking pressures should scatter by more than their size"
    )
