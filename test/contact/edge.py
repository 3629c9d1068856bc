"""Radius of elastic contacts by `contact_area` (theory.md, eq. edge-field), beside Hertz, Sneddon and the exact
rounded cone at the same load; the area of a tool that covers the end of a body. usage: edge.py [long] (in an empty directory; GIMP3D is the program)

Quasi-static sections of blunt tools, contacts of 2.5 to 3.5 and of 4.5 to 5.5 cells. With `long` the rounded
cone too, and a control: without the compliance below a cell single pressures are wrong, the edge is that of
the gaps alone, and the bounds must not hold."""

import sys
from pathlib import Path

import numpy as np
from checks import check, finish, require
from run_scene import run
from gimp3d.benchmark_measures import analysed
from gimp3d.run_data import History

SCENE = """&scene title='{name}', end_time=30 /
&grid geometry='axisymmetric', lower=0,0, upper=28e-6,28e-6, cell_size=1e-6,
      boundary='symmetry','free','roller','free' /
&time domain='{domain}' /
&material name='glass', model='elastic', density=2500, young=70e9, poisson=0.33 /
&body material='glass', shape='cylinder', center=0,0,0, radius=26e-6, height=26e-6 /
&tool name='tool', {tool}, tip=0,0,26e-6, axis=0,0,-1, times={times}, speeds={speeds} /
&quasi_static step=1, max_step=1 /
{contact}
&output directory='{name}', formats='none', history_every=1 /
"""
MODULUS = 70e9 / (1 - 0.33**2)
ENDS = """&scene title='{name}', end_time=0.5 /
&grid {grid}, cell_size=1 /
&material name='glass', model='elastic', density=1000, young=1e6, poisson=0 /
&body material='glass', {body} /
&tool name='tool', shape='flat', radius=50, tip=0,0,4, times=0, speeds=0.2 /
&quasi_static step=0.5 /
&output directory='{name}', formats='none' /
"""
AXISYMMETRIC = "geometry='axisymmetric', lower=0,0, upper=6,6, boundary='symmetry','free','symmetry','free'"
QUARTER = "lower=0,0,0, upper=6,6,6, boundary='symmetry','free','symmetry','free','symmetry','free'"
ROUND, SQUARE = "shape='cylinder', center=0,0,0, radius=4, height=4", "shape='box', lower=0,0,0, upper=4,4,4"
# what a tool covers: scene, area (m2), largest error (%): 6 % if faces counted beyond the body
COVERED = {
    "section": (AXISYMMETRIC, ROUND, np.pi * 16, 1.0),
    "square": (QUARTER, SQUARE, 16.0, 1.0),
    "round": (QUARTER, ROUND, np.pi * 4, 1.5),
}
BALL, SLOPE, TIP = (
    200e-6,
    np.tan(np.radians(6)),
    20e-6,
)  # of the sphere; of the cone; its rounded tip's radius
# steps of 1 s: from one of these times to the next the contact grows to one of these radii, on a half-space
TIMES, SIZES = np.array([0, 3, 15, 18, 30]), np.array([0, 2.35, 3.4, 4.3, 5.2]) * 1e-6
OFF = "&contact subcell=0 /"
LONG = sys.argv[1:] == ["long"]


def abel(a, slope):
    """a * integral from 0 to a of slope(r) / sqrt(a^2 - r^2) dr: the depth of a contact of a radius a is this
    (Sneddon 1965)."""
    t = (np.arange(400) + 0.5) / 400 * np.pi / 2
    return a * np.mean(slope(a * np.sin(t))) * np.pi / 2


def tables(slope):
    """Radii, depths and loads of a smooth tool on a half-space."""
    radius = np.linspace(0, 8e-6, 401)
    depth = np.array([abel(a, slope) for a in radius])
    area = np.concatenate([[0], np.cumsum(0.5 * (depth[1:] + depth[:-1]) * np.diff(radius))])
    return radius, depth, 2 * MODULUS * (radius * depth - area)


TOOLS = {
    # shape, slope over the radius, domain
    "sphere": (f"shape='sphere', radius={BALL}", lambda r: r / BALL, "fixed"),
    "cone": ("shape='cone', half_angle=84", lambda r: SLOPE + 0 * r, "fixed"),
    "rounded_cone": (
        f"shape='cone', half_angle=84, tip_radius={TIP}",
        lambda r: np.minimum(r / np.sqrt(TIP**2 - np.minimum(r, TIP / 2) ** 2), SLOPE),
        "fixed",
    ),
}


def errors(kind, contact=""):
    """Errors of the radius (%) and its exact size (cells) in each row with a contact."""
    shape, slope, domain = TOOLS[kind]
    radius, depth, load = tables(slope)
    speeds = np.diff(np.interp(SIZES, radius, depth)) / np.diff(TIMES)
    times = ",".join(f"{start},{end}" for start, end in zip(TIMES[:-1] + [0, 1, 1, 1], TIMES[1:]))
    speeds = ",".join(f"{speed:.6e},{speed:.6e}" for speed in speeds)
    name = kind + ("_without" if contact else "")
    run(SCENE.format(name=name, domain=domain, tool=shape, times=times, speeds=speeds, contact=contact), 1)
    rows = History(Path(f"{name}/tool_tool.dat"))
    pressed = rows["load_z"] > 0
    exact = np.interp(rows["load_z"][pressed], load, radius)
    found = np.sqrt(rows["contact_area"][pressed] / np.pi)
    return 100 * (found / exact - 1), exact * 1e6


def load_and_radius(kind):
    """Load (N) at the largest depth, and the exact radius (m) under it."""
    radius, _, load = tables(TOOLS[kind][1])
    last = History(Path(f"{kind}/tool_tool.dat"))["load_z"][-1]
    return last, np.interp(last, load, radius)


def within(off, cells, low, high):
    """Those of contacts of a size; there are enough."""
    chosen = off[(cells > low) & (cells < high)]
    require(f"{low} to {high} cells: rows", len(chosen) > 5)
    return chosen


for kind in TOOLS if LONG else ("sphere", "cone"):
    off, cells = errors(kind)
    few, more = within(off, cells, 2.5, 3.5), within(off, cells, 4.5, 5.5)
    print(
        f"   {kind}: radius {few.mean():+.2f} +- {few.std():.2f} % on 2.5 to 3.5 cells, "
        f"{more.mean():+.2f} +- {more.std():.2f} % on 4.5 to 5.5"
    )
    # of the area 4 and 2 %
    check(f"{kind}: radius on three cells, %", few, 2.0)
    check(f"{kind}: radius on five cells, %", more, 1.0)
    # `make hardness` of the run: load over the exact area under it
    answer, load, radius = analysed(kind), *load_and_radius(kind)
    off = answer["area_true"] / (np.pi * radius**2) - 1
    stated = answer["area_true_uncertainty"] / answer["area_true"]
    check(f"{kind}: hardness, %", 100 * (answer["hardness_true"] / load * np.pi * radius**2 - 1), 2.0)
    require(f"{kind}: area off by {100 * off:.2f} % of {100 * stated:.1f}", abs(off) < stated < 0.05)
for name, (grid, body, area, largest) in COVERED.items():
    run(ENDS.format(name=name, grid=grid, body=body), 1)
    found = History(Path(f"{name}/tool_tool.dat"))["contact_area"][-1]
    check(f"{name}: area of a covered end, %", 100 * (found / area - 1), largest)
if LONG:
    off, cells = errors("cone", OFF)
    largest = np.abs(within(off, cells, 2.5, 3.5)).max()
    print(f"   cone without the compliance below a cell: largest {largest:.1f} %")
    require("without the compliance below a cell it is above 3 %", largest > 3)
finish()
