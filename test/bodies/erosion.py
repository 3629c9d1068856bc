"""A rod hits a plate of another contact group, whose failed material is removed (theory.md, eq. uncovered).
usage: erosion.py (in an empty directory; GIMP3D is the program)"""

from pathlib import Path

import numpy as np
from checks import check, finish, require
from gimp3d.run_data import History
from run_scene import run
from runs import energy, snapshots

PLATE = """&material name='rod', model='elastic', density=7800, young=200e9, poisson=0.3 /
&material name='plate', model='j2', density=2700, young=70e9, poisson=0.3, yield_stress=300e6 /
&body name='rod', material='rod', shape='cylinder', center=0,0,0.5e-3, radius=3e-3, height=8e-3,
      velocity=0,0,-300, contact_group='rod' /
&body name='plate', material='plate', shape='cylinder', center=0,0,-5e-3, radius=9e-3, height=5e-3,
      contact_group='plate' /
&probe name='hit', position=0.25e-3,0,-0.25e-3 /
&damage constants=0.05,0,0,0,0, erode=.true. /
"""
GRID = {
    "section": "geometry='axisymmetric', lower=0,-12e-3, upper=12e-3,14e-3, "
    "boundary='symmetry','free','free','free'",
    "quarter": "lower=0,0,-12e-3, upper=12e-3,12e-3,14e-3, "
    "boundary='symmetry','free','symmetry','free','free','free'",
}


def fly_through(kind, ranks, cell, groups=True):
    """The rod's velocity along z at the end, m/s, and the share of the plate's mass that is within it."""
    name = f"{kind}_{ranks}_{'groups' if groups else 'one'}"
    text = (
        f"&scene title='rod through a plate', end_time=30e-6 /\n&grid {GRID[kind]}, cell_size={cell} /\n"
        + (PLATE if groups else PLATE.replace("contact_group='rod'", "").replace("contact_group='plate'", ""))
        + f"&output directory='{name}' /\n"
    )
    run(text, ranks)
    last = snapshots(name)[-1]
    probe = History(Path(name) / "probe_hit.dat")
    require(f"{name}: the probe's rows end with its particle", 0 < probe["time"][-1] < 25e-6)
    require(f"{name}: all its rows are of the particle", bool(np.all(probe["z"] < 0)))
    place, mass, body = last["position"], last["mass"].ravel(), last["body"].ravel()
    rod, plate = body == 1, body == 2
    low, high = place[rod][:, 2].min(), place[rod][:, 2].max()
    within = (np.hypot(place[:, 0], place[:, 1]) < 2.5e-3) & (place[:, 2] > low) & (place[:, 2] < high)
    speed = np.average(last["velocity"][rod][:, 2], weights=mass[rod])
    mass_at = energy(name)["mass"]
    print(f"   {name}: rod at {speed:.2f} m/s, {1e3 * (mass_at[0] - mass_at[-1]):.3g} g eroded")
    return speed, mass[plate & within].sum() / mass[plate].sum()


# faces that were inside at the start had no elements: the rod went on at 280 m/s, 2 % of the plate within it
one_field, _ = fly_through("section", 1, 0.5e-3, groups=False)
speed, within = fly_through("section", 1, 0.5e-3)
check("section: material of the plate within the rod, share", within, 0.001)
require("section: the rod is slowed all the way", -270 < speed < one_field)
again, _ = fly_through("section", 2, 0.5e-3)
check("section: speed on two ranks, relative", again / speed - 1, 1e-6)
speed, within = fly_through("quarter", 2, 1e-3)
check("quarter: material of the plate within the rod, share", within, 0.001)
require("quarter: the rod is slowed all the way", speed > -270)
finish()
