"""The compliance of the half-space below a cell (theory.md, eq. subcell). usage: subcell.py (in an empty
directory; GIMP3D is the program)

Rigid tools on an elastic cylinder, as sections, beside finite elements; without the term the same figures
must fail. Single pressures beside a smooth curve in 3D. A tool that presses and goes back."""

from pathlib import Path

import numpy as np
from checks import check, finish, require
from run_scene import ROOT, run
from runs import energy, snapshots
from gimp3d.run_data import History

SCENE = """&scene title='{name}', end_time={time} /
&grid geometry='axisymmetric', lower=0,0,0, upper=22e-6,1e-6,22e-6, cell_size=1e-6,
      boundary='symmetry','free','symmetry','symmetry','roller','free' /
&time domain='{domain}' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6, particles_per_cell=8 /
&tool name='tool', {tool}, tip=0,0,20e-6, axis=0,0,-1, {motion} /
{contact}
&output directory='{name}', formats='none' /
"""
TOOLS = {
    # shape, speed (m/s), time (s), table of finite elements, domain
    "punch": ("shape='flat', radius=2e-6", 2, 3e-8, "flat_hypo_h0.05", "fixed"),
    "sphere": ("shape='sphere', radius=10e-6", 20, 3e-8, "sphere_hypo_h0.1", "fixed"),
    "cone": ("shape='cone', half_angle=70.3", 27, 3.463e-8, "cone_hypo_h0.05", "corners"),
}
OFF = "&contact subcell=0 /"


def press(name, kind, contact="", motion=None, time=None):
    """A scene; its history and energies."""
    tool, speed, end, _, domain = TOOLS[kind]
    motion = motion or f"times=0,1e-8, speeds=0,{speed}"
    time = time or end
    run(SCENE.format(name=name, time=time, domain=domain, tool=tool, motion=motion, contact=contact), 1)
    return History(Path(f"{name}/tool_tool.dat")), energy(name)


def beside_elements(kind, rows):
    """Errors (%) of the load over the second half of the depth: mean, and the largest of them."""
    table = np.loadtxt(ROOT / f"test/references/fem/{TOOLS[kind][3]}.csv", delimiter=",", comments="#")
    depth, load = rows["depth"] * 1e6, rows["load_z"] * 1e6
    late = depth > 0.5 * table[-1, 0]
    power = {"punch": 1.0, "sphere": 1.5, "cone": 2.0}[kind]  # between the table's depths
    smooth = np.interp(depth[late], table[:, 0], table[:, 1] / np.maximum(table[:, 0], 1e-9) ** power)
    off = 100 * (load[late] / (smooth * depth[late] ** power) - 1)
    width = max(1, len(off) // 25)  # waves in the body aside
    return off.mean(), np.abs(np.convolve(off, np.ones(width) / width, "valid")).max()


def loads():
    """A punch, a sphere and a cone on 2, 2.2 and 1.5 to 2.3 cells of contact; the work is kept."""
    for kind, mean_bound, largest_bound, without in (
        ("punch", 1.0, 2.0, 8.0),
        ("sphere", 1.0, 3.5, 2.5),
        ("cone", 2.0, 4.0, 5.0),
    ):
        rows, balance = press(kind, kind)
        mean, largest = beside_elements(kind, rows)
        control, _ = press(f"{kind}_without", kind, OFF)
        mean_without, largest_without = beside_elements(kind, control)
        print(
            f"   {kind}: mean {mean:+.2f} %, largest {largest:.2f} %; without the term {mean_without:+.2f}, "
            f"{largest_without:.2f} %"
        )
        check(f"{kind}: mean error of the load, %", mean, mean_bound)
        check(f"{kind}: largest, %", largest, largest_bound)
        require(f"{kind}: without the term it is above {without} %", mean_without > without)
        check(f"{kind}: energy", balance["balance_error"][-1], 6e-3)
        check(f"{kind}: overlap beyond the term's, um", rows["max_gap_violation"].max() * 1e6, 5e-3)


def rims():
    """Flat punches whose rim stands anywhere between particles, beside finite elements (0.04 um deep)."""
    table = np.loadtxt(ROOT / "test/references/fem/flat_radii_hypo_h0.05.csv", delimiter=",", comments="#")
    off = {"": [], OFF: []}
    for radius, load in table:
        tool = f"shape='flat', radius={radius}e-6"
        for contact, errors in off.items():
            name = f"rim_{radius}_{len(contact)}"
            motion = "times=0,1e-8, speeds=0,2"
            scene = SCENE.format(
                name=name, time=2.5e-8, domain="fixed", tool=tool, motion=motion, contact=contact
            )
            run(scene, 1)
            rows = History(Path(f"{name}/tool_tool.dat"))
            late = rows["depth"] > 0.5 * rows["depth"][-1]
            stiffness = (rows["load_z"][late] / rows["depth"][late]).mean()
            errors.append(100 * (stiffness / (load / 0.04) - 1))
    print(f"   rims: errors of the load {np.round(off[''], 1)} %, without the term {np.round(off[OFF], 1)} %")
    check("rims: error of the load, %", np.array(off[""]), 3.0)
    require("rims: without the term they are apart by more than 8 %", np.ptp(off[OFF]) > 8)


CYLINDER = """&scene title='{name}', end_time=1.2e-8 /
&grid {grid}, cell_size=1e-6 /
&time domain='{domain}' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='cylinder', center=0,0,0, radius=8e-6, height=8e-6, fill='share' /
&tool name='tool', shape='flat', radius=2.25e-6, tip=0,0,8e-6, axis=0,0,-1, times=0,4e-9, speeds=0,2 /
&output directory='{name}', formats='none' /
"""
GRIDS = {
    "section": "geometry='axisymmetric', lower=0,0, upper=10e-6,10e-6, "
    "boundary='symmetry','free','roller','free'",
    "quarter": "lower=0,0,0, upper=10e-6,10e-6,10e-6, "
    "boundary='symmetry','free','symmetry','free','roller','free'",
}


def quarters():
    """A rim between particles, over a section and in the quarter of 3D that it stands for."""
    for domain in ("fixed", "corners"):
        load = {}
        for kind, grid in GRIDS.items():
            name = f"{kind}_{domain}"
            run(CYLINDER.format(name=name, grid=grid, domain=domain), 1)
            rows = History(Path(f"{name}/tool_tool.dat"))
            load[kind] = rows["load_z"][len(rows["load_z"]) // 2 :].mean()
        check(f"rim, {domain}: quarter beside its section", 4 * load["quarter"] / load["section"] - 1, 0.012)


def release():
    """A sphere goes in and out again: the energy below the cells comes back, and contact gives none."""
    gained = {}
    for name, contact in (("release", ""), ("release_without", OFF)):
        rows, balance = press(
            name, "sphere", contact, "times=0,5e-9,1e-8,2e-8,2.6e-8, speeds=0,20,20,-20,-20", 3.2e-8
        )
        require(f"{name}: nothing is pressed at the end", rows["load_z"][-1] == 0)
        gained[name] = 100 * (balance["balance_error"][-1])
    print(
        f"   release: {gained['release']:+.3f} % of the work is gained, without the term "
        f"{gained['release_without']:+.3f} %"
    )
    require("release: the term gives no energy", gained["release"] < gained["release_without"] + 0.1)
    check("release: and takes little", gained["release"], 1.0)


QUARTER = """&scene title='pressures', end_time=1.5e-8 /
&grid lower=0,0,0, upper=9e-6,9e-6,8e-6, cell_size=1e-6,
      boundary='symmetry','free','symmetry','free','roller','free' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='box', lower=0,0,0, upper=8e-6,8e-6,7e-6, particles_per_cell=8 /
&tool name='sphere', shape='sphere', radius=40e-6, tip=0,0,7e-6, axis=0,0,-1, times=0,5e-9, speeds=0,20 /
{contact}
&output directory='{name}', formats='hdf5', every=1.5e-8 /
"""


def pressures():
    """Single pressures inside 0.8 of a contact's radius of 3 cells lie on a curve p0 sqrt(1 - (r/a)^2)."""
    off = {}
    for name, contact in (("with", ""), ("off", OFF)):
        run(QUARTER.format(name=name, contact=contact), 1)
        data = snapshots(name)[-1].fields
        x, p = data["position"], data["contact_pressure"]
        radius = np.hypot(x[:, 0], x[:, 1])
        inside = (x[:, 2] > 6.2e-6) & (radius < 0.8 * radius[p > 0].max())
        line = np.polyfit(radius[inside] ** 2, p[inside] ** 2, 1)
        smooth = np.sqrt(np.maximum(np.polyval(line, radius[inside] ** 2), 0))
        off[name] = np.sqrt(np.mean((p[inside] - smooth) ** 2)) / smooth.mean()
    print(f"   pressures: rms {100 * off['with']:.1f} %, without the term {100 * off['off']:.1f} %")
    check("pressures of single points: rms beside a smooth curve", off["with"], 0.05)
    require("pressures: without the term it is above 10 %", off["off"] > 0.1)


loads()
rims()
quarters()
release()
pressures()
finish()
