"""Levels that the estimated error places hold all that is touched, from before the first step on and until
they are looked at again.

A punch wider than the ball around its tip, with no box given and with one; the load is that of a grid that is
as fine everywhere. Cones, cylinders, two tools, a tool of a file, contact groups: none runs out of the finest
level. The budget is that of all levels, and a run says when it binds."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from checks import finish, require
from gimp3d.run_data import History
from gimp3d.run_log import facts_of

GIMP3D, ROOT = sys.argv[1], Path(sys.argv[2])
SHIPPED = (ROOT / "input/wide_punch.nml").read_text()
LEVEL = re.search(r"^&level.*\n", SHIPPED, re.M).group(0)
TOOL = re.search(r"^&tool.*\n", SHIPPED, re.M).group(0)
END = 0.12


def run(name, level=LEVEL, tool=TOOL, end=END, cell=1, text=SHIPPED):
    text = text.replace(LEVEL, level).replace(TOOL, tool).replace("end_time=0.2", f"end_time={end}")
    text = text.replace("cell_size=1,", f"cell_size={cell},").replace(
        "'out/wide_punch', every=0.1", f"'{name}', formats='none'"
    )
    done = subprocess.run([GIMP3D], input=text, text=True, capture_output=True)
    return done.returncode, done.stdout, done.stderr


def cells_of(name):
    """Of the level that the error places, at the end."""
    return int(facts_of(Path(name, "cost.dat"))["cells_level_2"])


def load(name):
    return History(Path(name, "tool_punch.dat"))["load_z"][-1]


def works(name, **how):
    status, said, wrong = run(name, **how)
    require(f"{name}: status {status} {wrong.strip()}", status == 0)
    return said


works("fine", level="", cell=0.5)
works("coarse", level="")
said = works("placed")
boxed = works("in_a_box", level="&level criterion='error', lower=2,0,2, upper=18,8,9, max_cells=20000 /\n")
require(
    "a level with a box begins there, with what is touched: "
    + "".join(re.findall(r"^level 2 .*cells", boxed, re.M)),
    re.search(r"^level 2 +\(\S+ 0, 2\) to \(\S+ 8, 9\)", boxed, re.M),
)
for name in ("placed", "in_a_box"):
    require(
        f"{name}: load {100 * (load(name) / load('fine') - 1):+.2f} % off the fine grid's",
        abs(load(name) / load("fine") - 1) < 0.01,
    )
require(
    f"control: the coarse grid is {100 * (load('coarse') / load('fine') - 1):+.2f} % off",
    abs(load("coarse") / load("fine") - 1) > 0.02,
)

# the budget
require("a run says its budget", "budget     7500 cells of all levels that the error places together" in said)
require("and that it binds", "the budget left out cells with an error above the tolerance" in said)
cells = cells_of("placed")
require(f"and keeps to it: {cells} cells", cells <= 7500)
said = works("free", level="&level criterion='error', tolerance=0.02 /\n", end=0.06)
require(
    "it does not bind where there is room",
    "levels by the error: evaluated" in said and "the budget left out" not in said,
)
status, _, wrong = run("too_few", level="&level criterion='error', max_cells=2000 /\n")
require(
    wrong.strip(),
    status == 2
    and re.search(r"line \d+, &level max_cells=2000: the contact at the start needs \d+ cells", wrong),
)
said = works("in_memory", level="&level criterion='error', max_memory=38e6 /\n")
cells = cells_of("in_memory")
require(f"a budget in bytes is one: {cells} cells in 38 MB", 6832 <= cells <= 7600)
for size, sentence in (("1e5", "allowed: at least"), ("2e7", "the contact at the start needs")):
    status, _, wrong = run("too_little", level=f"&level criterion='error', max_memory={size} /\n")
    require(wrong.strip(), status == 2 and sentence in wrong and "&level max_memory" in wrong)
two = "&level criterion='error', max_cells={} /\n&level criterion='error', max_cells=100000 /\n"
status, _, wrong = run("too_few_together", level=two.format(18000), end=0.01)
require(wrong.strip(), status == 2 and "of the level and of finer ones" in wrong)
works("enough_together", level=two.format(100000), end=0.01)

# tools of other forms, and several; each comes from some way off
tools = {
    "cone": "&tool name='punch', shape='cone', half_angle=80, tip=10,0,6.3, times=0,0.01, speeds=0,5 /\n",
    "roll": "&tool name='punch', shape='cylinder', radius=7, edge=0,1,0, tip=10,0,6.3, times=0,0.01, "
    "speeds=0,8 /\n",
    "pyramid": "&tool name='punch', shape='berkovich', tip=10,4,6, times=0,0.01, speeds=0,5 /\n",
    "two": "&tool name='punch', shape='flat', radius=2, tip=4,0,6, times=0,0.01, speeds=0,4 /\n"
    "&tool name='ball', shape='sphere', radius=5, tip=15,0,6.2, times=0,0.01, speeds=0,5 /\n",
    "file": "&tool name='punch', shape='surface', file='block.stl', tip=10,4,6, times=0,0.01, speeds=0,3 /\n",
}
corners = np.array([[x, y, z] for z in (0, 3) for y in (-9, 9) for x in (-5, 5)], float)
with open("block.stl", "w") as stl:  # wide, with sharp edges, its foremost point its origin
    stl.write("solid block\n")
    for a, b, c, d in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)):
        for three in ((a, b, c), (a, c, d)):
            stl.write("facet normal 0 0 0\nouter loop\n")
            for k in three:
                stl.write("vertex {} {} {}\n".format(*corners[k]))
            stl.write("endloop\nendfacet\n")
    stl.write("endsolid block\n")
for name, tool in tools.items():
    works(name, tool=tool, level="&level criterion='error', tolerance=0.3 /\n", end=0.09)

# bodies of two contact groups that meet away from any tool
GROUPS = """&scene title='two balls', end_time=0.7 /
&grid lower=-8,-5,-5, upper=8,5,5, cell_size=1 /
&level criterion='error', max_cells=20000, tolerance=0.2 /
&material name='m', model='neo_hookean', density=1, young=100, poisson=0.3 /
&body name='left', material='m', shape='sphere', center=-3.6,0.1,0, radius=2.5, velocity=2,0,0, contact_group='left' /
&body name='right', material='m', shape='sphere', center=3.6,0,0, radius=2.5, velocity=-2,0,0, contact_group='right' /
&body_contact groups='left','right', friction=0.2 /
&output directory='groups', formats='none' /
"""
said = works("groups", text=GROUPS)
changed = float(facts_of("groups/cost.dat")["momentum_change_kg_m_s"])
require(f"groups: momentum changed by {changed}", changed < 1e-11)
pushed = [
    float(line.split()[-1])
    for line in Path("groups", "contact_left_right.dat").read_text().splitlines()
    if re.match(r"^\s*[-0-9]", line)
]
require("groups: rows of their contact", len(pushed) > 10)
status, _, wrong = run(
    "groups_control",
    text=GROUPS.replace(
        "&level criterion='error', max_cells=20000, tolerance=0.2 /", "&level lower=2,-2,-2, upper=6,2,2 /"
    ),
)
require(f"control: contact outside a level that stays: status {status}", status == 3)
finish()
