"""Pressure beside the edge of the finest of three levels, under a cone in metal that flows: means over the
cells of the level on either side, beside those of a grid whose fine level reaches beyond that edge. Fine
cells inside, coarse ones outside, particles' own pressures and recovered ones; the row of cells at the free
surface is left out."""

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
from checks import finish, require

GIMP3D = sys.argv[1]
SCENE = """&scene title='a cone in metal', end_time=80e-9 /
&grid lower=0,0,0, upper=16e-6,16e-6,18e-6, cell_size=1e-6, boundary='symmetry','free','symmetry','free','roller','free' /
&level lower=0,0,{low[0]}, upper=2*{wide[0]},18e-6 /
&level lower=0,0,{low[1]}, upper=2*{wide[1]},18e-6 /
&material name='al', model='j2', density=2700, young=70e9, poisson=0.33, yield_stress=300e6, hardening_modulus=700e6 /
&body material='al', shape='box', lower=0,0,0, upper=16e-6,16e-6,16e-6, particles_per_cell=8 /
&tool name='cone', shape='cone', half_angle=70.3, tip=0,0,16e-6, times=0,5e-9, speeds=0,10 /
&anti_locking /
&output directory='{name}', formats='hdf5' /
"""
LOW, WIDE, TOP = 13e-6, 3.5e-6, 16e-6  # of the finest level's edge, and the surface, m


def particles(name, low, wide):
    scene = SCENE.format(name=name, low=low, wide=wide)
    done = subprocess.run([GIMP3D], input=scene, text=True, capture_output=True)
    if done.returncode:
        sys.exit(f"{name} ends with status {done.returncode}: {done.stderr}")
    with h5py.File(sorted(Path(name).glob("particles_*.hdf"))[-1]) as file:
        group = file["VTKHDF"]
        data = group["PointData"]
        stresses = {field: data[field][:] for field in ("stress", "stress_recovered")}
        return group["Points"][:], data["volume"][:].ravel(), stresses


def cells(run, size):
    """By cell (whole numbers along the axes): mean pressure and von Mises stress of both fields, Pa."""
    places, volume, stresses = run
    keys, which = np.unique(np.floor(places / size).astype(int), axis=0, return_inverse=True)
    which = which.ravel()
    total = np.bincount(which, volume)
    found = {}
    for field, stress in stresses.items():
        pressure = -stress[:, :3].mean(axis=1)
        normal = stress[:, :3] + pressure[:, None]
        mises = np.sqrt(1.5 * (normal**2).sum(axis=1) + 3 * (stress[:, 3:] ** 2).sum(axis=1))
        means = [np.bincount(which, volume * value) / total for value in (pressure, mises)]
        found[field] = dict(zip(map(tuple, keys), zip(*means)))
    return found


def beside_the_edge(key, size, inside):
    """Cells that touch the edge from one of its sides, away from the surface."""
    middle = np.array(key) + 0.5
    if middle[2] > TOP / size - 1 or min(key) < 0:
        return False
    within = lambda place: max(abs(place[0]), abs(place[1])) < WIDE / size and place[2] > LOW / size
    near = [within(middle + np.array(step) - 1) for step in np.ndindex(3, 3, 3)]
    return within(middle) == inside and any(near) and not all(near)


placed = particles("placed", (10e-6, LOW), (6e-6, WIDE))
fine = particles("fine", (7e-6, 10e-6), (9e-6, 6e-6))
for side, size in (("inside", 0.25e-6), ("outside", 0.5e-6)):
    one, other = cells(placed, size), cells(fine, size)
    for field, own in (("stress", "of the particles"), ("stress_recovered", "recovered")):
        keys = [k for k in one[field] if k in other["stress"] and beside_the_edge(k, size, side == "inside")]
        means = np.array([one[field][key] for key in keys])
        exact = np.array([other["stress"][key] for key in keys])
        for number, what in enumerate(("pressure", "von Mises stress")):
            level = np.sqrt(np.mean(exact[:, number] ** 2))
            off = np.abs(means - exact)[:, number] / level
            rms, most = 100 * np.sqrt(np.mean(off**2)), 100 * off.max()
            require(
                f"{len(keys)} cells {side}, {what} {own}: off by {rms:.1f} % rms, {most:.1f} % at most, of "
                f"{1e-6 * level:.0f} MPa",
                rms < 8 and most < 17,
            )
finish()
