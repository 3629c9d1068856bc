"""The thesis's five examples, E1 to E5, as shipped, beside what is known of them: E1's pressure; the loads of
E2, E3 and E4, and of E3 with domains that follow and slower, beside finite elements of bodies of the same
area; E5's stresses and plastic strain on one and two levels beside CalculiX (test/references/fem). Prints the
table of doc/user/accuracy.md. usage: thesis.py [E1 E5 ...] (all when none is named)"""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from checks import check, finish
from gimp3d.indentation import read_reference
from gimp3d.run_data import History
from run_scene import ROOT, probe, replace, run

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
    text = text.replace(directory, changes["to"])
    if "formats='none'" not in text:
        text = text.replace("&output ", "&output formats='none', ")
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


def show(name, what, right, mine, off):
    """One line of the table; `right`, `mine` in the units that it states."""
    numbers = lambda values: ", ".join(f"{v:.4g}" for v in values)
    print(f"| {name} | {what} | {numbers(right)} | {numbers(mine)} | {numbers_off(off)} |", flush=True)


def numbers_off(off):
    return ", ".join(f"{100 * v:+.1f}" for v in off)


def row(name, what, text, directory, bounds, late=0.0):
    """`text`: the scene; None: it has been run."""
    if text:
        run(text, 1)
    at = DEPTHS[name]
    mine, right = load(directory, at, late), reference(name, np.array(at))
    off = mine / right - 1
    show(name, what, 1e3 * right, 1e3 * mine, off)
    for depth, far, bound in zip(at, off, bounds):
        check(f"{name}, {what}, {1e9 * depth:.0f} nm: load against finite elements", far, bound)


def row_of_e1():
    """The stress under the middle of E1's patch after 0.4 ns: minus the pressure (whole at 0.2 ns)."""
    run(scene("scaling_pressure", to="e1"), 1)
    seen = probe("e1", "top")
    late = seen["time"] > 4e-10
    szz, work = seen["stress_zz"][late].mean() / 1e6, History(Path("e1/energy.dat"))
    show("E1", "as shipped: szz under the patch", [-100.0], [szz], [szz / -100 - 1])
    check("E1: szz against the pressure", szz / -100 - 1, 0.02)
    check("E1: balance of energy", work["balance_error"][-1], 0.01)
    subprocess.run([sys.executable, "-m", "gimp3d", "plots", "e1"], check=True, capture_output=True)
    check(
        "E1: the figure of time over ranks is there", 0 if Path("e1/time_per_step.png").is_file() else 1, 0.5
    )
    stored = np.genfromtxt(ROOT / "test/references/time_per_step.csv", delimiter=",", names=True)
    off = stored["model_ms"][1] / stored["measured_ms"][1] - 1
    show("E1", "ms a step on 2 ranks, the model", stored["measured_ms"][1:2], stored["model_ms"][1:2], [off])


def rows_of_e5():
    """Quantity by quantity at four pressures, on one level and on two: means of eight particles."""
    stored = [np.genfromtxt(FEM / f"E5_patch_h{h}.csv", delimiter=",", names=True) for h in ("0.167", "0.5")]
    at = np.array([100.0, 200.0, 300.0, 400.0])
    references = {
        "szz": ("stress_zz", "stress_zz_MPa", 1e-6),
        "von Mises": ("von_mises", "von_mises_MPa", 1e-6),
        "sxx": ("stress_xx", "stress_xx_MPa", 1e-6),
        "plastic strain [%]": ("equivalent_plastic_strain", "equivalent_plastic_strain", 100.0),
    }
    for cells, shipped in (("one level", "bilinear_patch"), ("two levels", "bilinear_levels")):
        text = scene(shipped, to="e5")
        if shipped == "bilinear_levels":  # around the point stand eight particles half as far from it
            text = text.replace("0.375e-3", "0.3125e-3").replace("0.125e-3", "0.1875e-3")
            text = text.replace("6.625e-3", "6.6875e-3").replace("6.875e-3", "6.8125e-3")
        run(text, 1)
        probes = [probe("e5", name) for name in "abcdefgh"]
        pressure = 400 * probes[0]["time"] / 20e-6
        for title, (column, name, factor) in references.items():
            size = 100.0 if "%" in title else 1.0
            fine = size * np.interp(at, stored[0]["pressure_MPa"], stored[0][name])
            mine = factor * np.interp(at, pressure, np.mean([one[column] for one in probes], axis=0))
            scale = np.abs(fine).max() if "%" in title else fine  # there is no plastic strain at 100 MPa
            off, bound = (mine - fine) / scale, 0.1 if shipped == "bilinear_levels" else 0.25
            show("E5", f"{title}, {cells}", fine, mine, off)
            check(f"E5, {cells}, {title}: against finite elements", off, bound)
        for title, (_, name, _) in references.items():
            fine, coarse = (np.interp(at, table["pressure_MPa"], table[name]) for table in stored)
            print(f"E5, {title}: the coarser mesh over the finer: {coarse / np.where(fine, fine, 1)}")


chosen = sys.argv[1:] or ["E1", "E2", "E3", "E4", "E5"]
for name, at in DEPTHS.items():
    if name not in chosen:
        continue
    at = np.array([d for d in at if d > 0.3 * max(at)])
    off = reference(name, at, 1) / reference(name, at) - 1
    print(
        f"| {name} | finite elements, the finer and the coarser mesh | "
        + " | ".join(
            ", ".join(f"{1e3 * v:.4g}" for v in reference(name, np.array(DEPTHS[name]), which))
            for which in (0, 1)
        )
        + f" | {numbers_off(off)} |"
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
if "E1" in chosen:
    row_of_e1()
if "E2" in chosen:
    row("E2", "as shipped", scene("cone", to="e2"), "e2", (0.08, 0.05, 0.05, 0.05, 0.05, 0.05))
    behind = (0.5 - 0.4) * 32e-9  # of a particle's face the contact points are
    row("E2", "as shipped, depth counted from contact on", None, "e2", 6 * (0.03,), late=behind)
    faces = ("penetration_factor=0.4", "penetration_factor=0.5")
    text = scene("cone", to="e2_follows", words=[FOLLOWS, faces])
    row("E2", "domains that follow, contact points on the faces", text, "e2_follows", 6 * (0.03,))
if "E3" in chosen:
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
if "E4" in chosen:
    row("E4", "as shipped, a quarter", scene("cone_levels", to="e4", words=QUARTER), "e4", (0.08, 0.08, 0.08))
if "E5" in chosen:
    rows_of_e5()
finish()
