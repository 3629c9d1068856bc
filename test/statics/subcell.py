"""The compliance below a cell in quasi-static steps (theory.md, eq. static-subcell). usage: subcell.py (in an
empty directory; GIMP3D is the program)"""

import math
import os
import subprocess
from pathlib import Path

import numpy as np
from checks import check, finish, require
from run_scene import ROOT, run
from scipy.optimize import brentq
from static_scenes import History

SCENE = """&scene title='{name}', end_time={end} /
&grid geometry='axisymmetric', lower=0,0,0, upper=22e-6,1e-6,22e-6, cell_size=1e-6,
      boundary='symmetry','free','symmetry','symmetry','roller','free' /
&time domain='fixed' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6, particles_per_cell=8 /
&tool name='tool', {tool}, tip=0,0,20e-6, axis=0,0,-1, {motion} /
{more}
&output directory='{name}', formats='none', history_every=1e-12 /
"""
TOOLS = {
    # shape, depth (um), table of finite elements, power of the depth, bounds (%): mean; mean without the term
    "punch": ("shape='flat', radius=2e-6", 0.05, "flat_hypo_h0.05", 1.0, 0.5, 8.0),
    "sphere": ("shape='sphere', radius=10e-6", 0.5, "sphere_hypo_h0.1", 1.5, 1.5, 2.5),
    "cone": ("shape='cone', half_angle=70.3", 0.8, "cone_hypo_h0.05", 2.0, 1.5, 1.5),
}
STEPS = "&quasi_static step=0.1, max_step=0.1 /"
OFF = "&contact subcell=0 /\n"


def press(name, kind, more=STEPS, motion=None, end=1):
    """A scene; the history of its tool."""
    tool, depth = TOOLS[kind][:2]
    motion = motion or f"times=0, speeds={depth}e-6"
    run(SCENE.format(name=name, end=end, tool=tool, motion=motion, more=more), 1)
    return History(Path(f"{name}/tool_tool.dat"))


def beside_elements(kind, rows):
    """Mean error (%) of the load over the second half of the depth."""
    _, most, table, power = TOOLS[kind][:4]
    table = np.loadtxt(ROOT / f"test/references/fem/{table}.csv", delimiter=",", comments="#")
    depth, load = rows["depth"] * 1e6, rows["load_z"] * 1e6
    late = depth > 0.5 * most
    smooth = np.interp(depth[late], table[:, 0], table[:, 1] / np.maximum(table[:, 0], 1e-9) ** power)
    return 100 * (load[late] / (smooth * depth[late] ** power) - 1).mean()


def loads():
    """A punch, a sphere and a cone on 2, 2.2 and 1.5 to 2.3 cells of contact; energy is kept."""
    for kind in TOOLS:
        bound, without = TOOLS[kind][4:]
        rows = press(kind, kind)
        off, control = beside_elements(kind, rows), beside_elements(kind, press("control", kind, OFF + STEPS))
        print(f"   {kind}: mean error {off:+.2f} %, without the term {control:+.2f} %")
        check(f"{kind}: mean error of the load, %", off, bound)
        require(f"{kind}: without the term it is above {without} %", control > without)
        check(f"{kind}: overlap beyond the term's, um", rows["max_gap_violation"].max() * 1e6, 1e-3)


def restart():
    """Taken up again in the middle a run goes on to the same bits."""
    rows = press("again", "sphere", STEPS + "\n&checkpoint every_steps=5 /")
    max(Path("again").glob("checkpoint_*.h5")).unlink()
    done = subprocess.run([os.environ["GIMP3D"], "--restart", "again"], check=False, capture_output=True)
    require("restart: status", done.returncode == 0)
    after = History(Path("again/tool_tool.dat"))
    require("restart: the same bits", bool(np.array_equal(rows["load_z"], after["load_z"])))


def let_go():
    """A sphere that quasi-static steps have pressed, held by explicit ones: its load goes on."""
    rows = press(
        "let_go",
        "sphere",
        "&quasi_static step=0.2, max_step=0.2, to=1 /",
        "times=0,1,1.000000001, speeds=0.5e-6,0.5e-6,0",
        1 + 6e-8,
    )
    held = rows["load_z"][rows["time"] <= 1][-1]
    after = rows["load_z"][rows["time"] > 1 + 1e-9]
    print(f"   let go: afterwards {after.min() / held:.4f} to {after.max() / held:.4f} of the load held")
    require("let go: explicit steps follow", after.size > 20)
    check("let go: load in explicit steps, off that held", after / held - 1, 0.01)


def compressed(poisson, depth):
    """A cylinder of rubber under a smooth plate, beside uniaxial stress. Its top gives way to more force
    when it tilts. Deflections below cells then grew from one iteration to the next, and steps found no
    equilibrium from 26 % (Poisson's ratio 0) and 45 % (0.45) on."""
    young, size = 1e6, 1e-2
    name = f"compressed_{100 * poisson:.0f}"
    Path(f"{name}.nml").write_text(
        f"&scene title='rubber under a plate', end_time=1 /\n"
        "&grid geometry='axisymmetric', lower=0,0, upper=2e-2,1.2e-2, cell_size=1e-3,\n"
        "boundary='symmetry','free','symmetry','free' /\n"
        f"&material name='rubber', model='neo_hookean', density=1000, young={young}, poisson={poisson} /\n"
        f"&body material='rubber', shape='box', lower=0,0,0, upper={size},1e-3,{size} /\n"
        f"&tool name='tool', shape='flat', radius=2e-2, tip=0,0,{size}, times=0, speeds={depth * size} /\n"
        f"&quasi_static step=0.02 /\n&output directory='{name}', formats='none' /\n"
    )
    done = subprocess.run([os.environ["GIMP3D"], f"{name}.nml"], capture_output=True, text=True)
    require(f"plate, Poisson's ratio {poisson}: status", done.returncode == 0)
    rows = History(Path(f"{name}/tool_tool.dat"))
    shear, bulk = young / 2 / (1 + poisson), young / 3 / (1 - 2 * poisson)

    def stresses(height, width):
        volume = height * width**2
        mean, factor = (height**2 + 2 * width**2) / 3, shear * volume ** (-2 / 3)
        return [factor * (x * x - mean) + bulk * (volume - 1) * volume for x in (width, height)]

    off = []
    for height, load in zip(1 - rows["depth"] / size, rows["load_z"]):
        if height > 0.95:
            continue
        width = brentq(lambda x: stresses(height, x)[0], 0.2, 5.0)
        off.append(load / (-math.pi * size**2 * stresses(height, width)[1] / height) - 1)
    name = f"plate, Poisson's ratio {poisson}: load to a height of {1 - depth:.2f}, off uniaxial stress"
    check(name, off, 2e-3)


loads()
compressed(0.45, 0.5)
compressed(0.0, 0.55)
restart()
let_go()
finish()
