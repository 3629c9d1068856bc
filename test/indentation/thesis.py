"""The thesis's E2, E3 and E4: the load of the shipped scenes, and of E3 on finer cells, with domains that follow
and slower, beside finite elements of bodies of the same area (test/references/fem). Prints the table of
doc/user/accuracy.md. usage: thesis.py [short]"""

import re
import sys
from pathlib import Path

import numpy as np

from checks import check, finish
from gimp3d.indentation import read_reference
from gimp3d.run_data import History
from run_scene import ROOT, replace, run

FEM = ROOT / "test/references/fem"
REFERENCES = {
    "E2": ("E2_cone_hypo_h0.024.csv", "E2_cone_hypo_h0.048.csv"),
    "E3": ("E3_sphere_hypo_h0.15.csv", "E3_sphere_hypo_h0.3.csv"),
    "E4": ("E4_cone_hypo_h0.012.csv", "E4_cone_hypo_h0.024.csv"),
}
DEPTHS = {
    "E2": (1e-7, 2e-7, 3e-7, 4.15e-7, 5e-7, 5.65e-7),
    "E3": (1e-6, 2e-6, 2.73e-6, 3.11e-6),
    "E4": (8e-8, 1.2e-7, 1.6e-7),
}


def reference(name, at, which=0):
    """Load on the quarter, N."""
    depth, load = read_reference(FEM / REFERENCES[name][which])
    return np.interp(at, depth, load) / 4


def scene(name, **changes):
    """A shipped scene with other words, and its directory."""
    text = (ROOT / f"input/{name}.nml").read_text()
    for old, new in changes.get("words", ()):
        text = replace(text, old, new)
    directory = re.search("directory='([^']*)'", text)[1]
    text = text.replace(directory, changes["to"]).replace("&output ", "&output formats='none', ")
    return re.sub(r",? every=[0-9.e-]+", "", text)


def load(directory, at, late):
    """By a line over a few percent of the depth around each: the load rings. `late`: the depth at which contact
    begins, as contact points lie behind the faces of particles (penetration_factor below 0.5)."""
    rows = History(next(Path(directory).glob("tool_*.dat")))
    at = np.array(at) + late
    found = []
    for depth in at:
        near = np.abs(rows["depth"] / depth - 1) < 0.05
        found.append(np.polyval(np.polyfit(rows["depth"][near], rows["load_z"][near], 1), depth))
    return np.array(found)


def row(name, what, text, directory, bounds, late=0.0):
    run(text, 1)
    at = DEPTHS[name]
    mine, right = load(directory, at, late), reference(name, np.array(at))
    off = mine / right - 1
    print(
        f"| {name} | {what} | "
        + ", ".join(f"{1e3 * v:.4g}" for v in mine)
        + " | "
        + ", ".join(f"{100 * v:+.1f}" for v in off)
        + " |",
        flush=True,
    )
    for depth, far, bound in zip(at, off, bounds):
        check(f"{name}, {what}, {1e9 * depth:.0f} nm: load against finite elements", far, bound)


for name, at in DEPTHS.items():
    at = np.array([d for d in at if d > 0.3 * max(at)])
    off = reference(name, at, 1) / reference(name, at) - 1
    print(
        f"| {name} | finite elements | "
        + ", ".join(f"{1e3 * v:.4g}" for v in reference(name, np.array(DEPTHS[name])))
        + " | |"
    )
    check(f"{name}: two meshes of finite elements against each other", off, 0.01)
QUARTER = (
    ("lower=-3008e-9,-3008e-9,0", "lower=0,0,0"),
    (
        "boundary='free','free','free','free','roller','free'",
        "boundary='symmetry','free','symmetry','free','roller','free'",
    ),
    ("lower=-704e-9,-704e-9,960e-9", "lower=0,0,960e-9"),
    ("lower=-512e-9,-512e-9,1216e-9", "lower=0,0,1216e-9"),
    ("lower=-2816e-9,-2816e-9,0", "lower=0,0,0"),
)
FOLLOWS = ("domain='fixed'", "domain='corners'")
SLOW = (("end_time=2.466e-8", "end_time=6.6e-8"), ("speeds=0,150.8", "speeds=0,50"))
row("E3", "as shipped, two levels", scene("sphere_levels", to="e3"), "e3", (0.1, 0.15, 0.2, 0.2))
row(
    "E3",
    "domains that follow",
    scene("sphere_levels", to="e3_follows", words=[FOLLOWS]),
    "e3_follows",
    (0.1, 0.05, 0.05, 0.05),
)
row(
    "E3",
    "domains that follow, 50 m/s, depth from contact on",
    scene("sphere_levels", to="e3_slow", words=[FOLLOWS, *SLOW]),
    "e3_slow",
    (0.03, 0.03, 0.03, 0.03),
    late=(0.5 - 0.4) * 0.64e-6,
)
energy = History(Path("e3_slow/energy.dat"))
check("E3, 50 m/s: kinetic energy over work", energy["kinetic"][-1] / energy["external_work"][-1], 0.01)
row("E4", "as shipped, a quarter", scene("cone_levels", to="e4", words=QUARTER), "e4", (0.08, 0.08, 0.08))
row("E2", "as shipped", scene("cone", to="e2"), "e2", (0.2, 0.1, 0.1, 0.05, 0.05, 0.05))
finish()
