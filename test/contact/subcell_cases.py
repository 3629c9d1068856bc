"""The compliance below a cell (theory.md, eq. subcell) where materials meet, on levels, wherever a tool stands
in a cell, and in single pressures. usage: subcell_cases.py [long] (in an empty directory; GIMP3D is the
program)

Quasi-static sections of elastic blocks. With `long` more places, and controls: the same without the term."""

import sys
from pathlib import Path

import numpy as np
from checks import check, finish, require
from run_scene import run
from runs import snapshots
from gimp3d.run_data import History

OFF = "&contact subcell=0 /"
LONG = sys.argv[1:] == ["long"]
CASES = ("with", "off") if LONG else ("with",)
HARD = ", compliance=1e-6, tolerance=1e-10 /"  # points of their own give way less than is compared
STRIP = """&scene title='{name}', end_time=1 /
&grid geometry='plane_strain', lower=-{width}e-6,0, upper={width}e-6,{top}e-6, cell_size=1e-6,
      boundary='roller','roller','roller','free' /
{levels}
{materials}
&tool name='tool', {tool}, axis=0,0,-1, times=0, speeds={way}e-6 /
&quasi_static step={step}, max_step={step} /
{contact}
&output directory='{name}', formats='none', history_every={step} /
"""


def material(name, young):
    return f"&material name='{name}', model='elastic', density=2500, young={young}e9, poisson=0.3 /\n"


def box(name, low, high, height):
    return f"&body material='{name}', shape='box', lower={low}e-6,0,0, upper={high}e-6,1e-6,{height}e-6 /\n"


def strip(name, **rest):
    given = dict(name=name, width=12, top=14, levels="", contact="", step=0.1) | rest
    run(STRIP.format(**given), 1)
    return History(Path(f"{name}/tool_tool.dat"))


BLOCK = """&scene title='{name}', end_time=3e-9 /
&grid lower=0,0,0, upper=6e-6,3e-6,5e-6, cell_size=1e-6,
      boundary='roller','roller','roller','roller','roller','free' /
&material name='soft', model='cubic', density=2500, c11=100e9, c12=40e9, c44=10e9 /
&material name='stiff', model='cubic', density=2500, c11=100e9, c12={c12}e9, c44=50e9 /
&body material='soft', shape='box', lower=0,0,0, upper=3.5e-6,3e-6,3e-6 /
&body material='stiff', shape='box', lower=3.5e-6,0,0, upper=6e-6,3e-6,3e-6 /
&tool name='tool', shape='flat', radius=20e-6, tip=0,0,3e-6, axis=0,0,-1, times=0,1e-9, speeds=0,2 /
{contact}
&output directory='{name}', formats='none', history_every=3e-11 /
"""


def uniform():
    """Crystals that resist uniaxial strain alike and shear differently, side by side, their seam in the middle
    of a cell: one pressure everywhere deflects nothing, whatever half-spaces meet. Not so where the pressure
    is not one: crystals that push each other aside."""
    for name, lateral, bound in (("alike", 40, 1e-6), ("apart", 10, None))[: 1 + LONG]:
        load = {}
        for off, contact in (("", "&contact subcell=0.35" + HARD), ("_off", "&contact subcell=0" + HARD)):
            run(BLOCK.format(name=name + off, c12=lateral, contact=contact), 1)
            rows = History(Path(f"{name}{off}/tool_tool.dat"))
            load[off] = rows["load_z"]
            require("seam: the term is there", (rows["max_deflection"].max() > 1e-10) == (off == ""))
        change = np.abs(load[""] - load["_off"]).max() / load[""].max()
        if bound:
            check("seam, one pressure: change of the load by the term", change, bound)
        else:
            require(f"seam, two pressures: it is {change:.1e}, above 1e-5", change > 1e-5)


def roller(name, contact="", place=0.0, seam=True, fine=False):
    """A roller over a strip; over the seam of two materials, one four times as stiff."""
    levels = "&level lower=-7e-6,0,5e-6, upper=7e-6,0,14e-6 /" if fine else ""
    if seam:
        materials = material("stiff", 70) + material("soft", 17.5)
        materials += box("stiff", -12, 0, 12) + box("soft", 0, 12, 12)
    else:
        materials = material("stiff", 70) + box("stiff", -12, 12, 12)
    tool = f"shape='cylinder', radius=100e-6, edge=0,1,0, tip={place}e-6,0,12e-6"
    return strip(name, levels=levels, materials=materials, tool=tool, way=0.15, contact=contact)


def seams():
    """Loads over a seam on 2 to 3.7 cells a half-width, beside those on cells of a half."""
    fine = roller("seam_fine", fine=True)
    rms = {}
    for name in CASES:
        rows = roller(f"seam_{name}", OFF if name == "off" else "")
        late = rows["depth"] > 0.29 * rows["depth"][-1]
        exact = np.interp(rows["depth"][late], fine["depth"], fine["load_z"])
        off = 100 * (rows["load_z"][late] / exact - 1)
        rms[name] = np.sqrt(np.mean(off**2))
    print(f"   seam: rms, % {rms}")
    check("seam: load beside fine cells, rms, %", rms["with"], 0.7)
    if LONG:
        require("seam: without the term it is above 0.8 %", rms["off"] > 0.8)


def places():
    """The load of a roller at three or six places in a cell, on 2 to 3 cells a half-width: its range."""
    spread = {}
    for name in CASES:
        loads = []
        for n in range(6) if LONG and name == "with" else (0, 2, 3):
            rows = roller(f"place_{name}_{n}", OFF if name == "off" else "", place=n / 6, seam=False)
            loads.append(rows["load_z"][4:9])
        wide = rows["contact_area"][4:9] / 2e-6
        spread[name] = 100 * np.ptp(loads, axis=0) / np.mean(loads, axis=0)
    for name in CASES:
        print(f"   {name}: half-widths {np.round(wide, 1)} cells, ranges {np.round(spread[name], 2)} %")
    check("places: range of the load, %", spread["with"], 0.5)
    if LONG:
        require("places: without the term it is above 1.5 %", spread["off"].max() > 1.5)


SECTION = """&scene title='{name}', end_time=1 /
&grid geometry='axisymmetric', lower=0,0, upper=14e-6,14e-6, cell_size={cell}e-6,
      boundary='symmetry','free','roller','free' /
{levels}
&material name='glass', model='elastic', density=2500, young=70e9, poisson=0.33 /
&body material='glass', shape='cylinder', center=0,0,0, radius=12e-6, height=12e-6 /
&tool name='tool', shape='sphere', radius=50e-6, tip=0,0,12e-6, axis=0,0,-1, times=0, speeds=0.1e-6 /
&quasi_static step=0.1, max_step=0.1 /
{contact}
&output directory='{name}', formats='none', history_every=0.1 /
"""


def levels():
    """The term in the finest of two levels, and on one level of its cells."""
    load = {}
    for name, cell, text in (
        ("one", 0.5, ""),
        ("two", 1, "&level lower=0,0,6e-6, upper=6e-6,0,14e-6 /"),
        ("without", 1, "&level lower=0,0,6e-6, upper=6e-6,0,14e-6 /"),
    )[: 2 + LONG]:
        contact = OFF if name == "without" else ""
        run(SECTION.format(name=name, cell=cell, levels=text, contact=contact), 1)
        load[name] = History(Path(f"{name}/tool_tool.dat"))["load_z"][2:]
    check("levels: load on two over that on one, less 1, %", 100 * (load["two"] / load["one"] - 1), 0.3)
    if LONG:
        off = np.abs(100 * (load["without"] / load["one"] - 1)).max()
        require(f"levels: without the term it is off by {off:.1f} %, above 0.5", off > 0.5)


QUARTER = """&scene title='{name}', end_time=1 /
&grid lower=0,0,0, upper=20e-6,20e-6,20e-6, cell_size=2e-6,
      boundary='symmetry','free','symmetry','free','roller','free' /
&level lower=0,0,10e-6, upper=8e-6,8e-6,20e-6 /
&material name='glass', model='elastic', density=2500, young=70e9, poisson=0.33 /
&body material='glass', shape='box', lower=0,0,0, upper=18e-6,18e-6,18e-6 /
&tool name='tool', shape='sphere', radius=100e-6, tip=0,0,18e-6, axis=0,0,-1, times=0, speeds=0.147e-6 /
&quasi_static step=1 /
{contact}
&output directory='{name}', formats='hdf5' /
"""


def pressures():
    """Single pressures inside 0.8 of a contact's radius of 4 cells beside Hertz's of the same load, in 3D."""
    modulus, ball = 70e9 / (1 - 0.33**2), 100e-6
    off = {}
    for name, contact in (("points", ""), ("points_off", OFF))[: 1 + LONG]:
        run(QUARTER.format(name=name, contact=contact), 1)
        load = 4 * History(Path(f"{name}/tool_tool.dat"))["load_z"][-1]
        radius = (0.75 * load * ball / modulus) ** (1 / 3)
        largest = 1.5 * load / (np.pi * radius**2)
        data = snapshots(name)[-1].fields
        r = np.hypot(*data["position"][:, :2].T)
        inside = (data["position"][:, 2] > 17.5e-6) & (r < 0.8 * radius)
        exact = largest * np.sqrt(1 - (r[inside] / radius) ** 2)
        off[name] = 100 * np.sqrt(np.mean((data["contact_pressure"][inside] / exact - 1) ** 2))
        print(f"   {name}: {1e6 * radius:.2f} cells, {inside.sum()} points, rms {off[name]:.1f} %")
    check("pressures of single points: rms beside Hertz, %", off["points"], 5.0)
    if LONG:
        require("pressures: without the term it is above 12 %", off["points_off"] > 12)


uniform()
seams()
places()
levels()
pressures()
finish()
