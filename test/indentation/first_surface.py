"""Gaps between tips and surfaces of known places: bodies, cuts, files, sections; the depths that follow."""

import math
from pathlib import Path

import numpy as np

from gimp3d import History, Run, Unreadable, run
from gimp3d import indentation
from checks import check, finish, require

cell = 1e-6
block = "&body name='block', material='a', shape='box', lower=0,0,0, upper=8e-6,8e-6,6e-6, fill='whole' /"
quarter = "'symmetry','free','symmetry','free','roller','free'"


def box_file(path, lower, upper):
    """An STL file of a box, in metres."""
    corners = np.array([[(lower, upper)[n >> i & 1][i] for i in range(3)] for n in range(8)])
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [face[i:j] + face[k : k + 1] for face in faces for i, j, k in ((0, 2, 2), (2, 4, 0))]
    with open(path, "w") as file:
        file.write("solid box\n")
        for triangle in triangles:
            file.write("facet normal 0 0 0\nouter loop\n")
            file.writelines("vertex {} {} {}\n".format(*map(float, corners[n])) for n in triangle)
            file.write("endloop\nendfacet\n")
        file.write("endsolid box\n")


def start_of(name, bodies, tip=(0, 0, 6e-6), axis=(0, 0, -1), sides=quarter, grid="", radius=20e-6):
    """The run of a few steps of a tool over bodies."""
    grid = grid or f"&grid lower=0,0,0, upper=10e-6,10e-6,12e-6, cell_size={cell}, boundary={sides} /"
    return run(
        f"""&scene title='{name}', end_time=2e-10 /
{grid}
&material name='a', model='elastic', density=2710, young=70e9, poisson=0.33 /
{bodies}
&tool name='tip', shape='sphere', radius={radius}, tip={",".join(map(str, tip))},
      axis={",".join(map(str, axis))}, times=0, speeds=1 /
&output directory='{name}', formats='none' /
""",
        progress=False,
    )


def cut(shape):
    return f"{block}\n&cut body='block', {shape} /"


box_file("layer.stl", (0, 0, 6e-6), (8e-6, 8e-6, 8e-6))
box_file("pit.stl", (-2e-6, -2e-6, 5e-6), (4e-6, 4e-6, 9e-6))
ring = "&body name='ring', material='a', shape='cylinder', center=0,0,0, radius=8e-6, height=6e-6 /\n"
ring += "&cut body='ring', shape='cylinder', center=0,0,-1e-6, radius=4e-6, height=9e-6 /"
section = "&grid geometry='axisymmetric', lower=0,0,0, upper=10e-6,1e-6,12e-6, cell_size=1e-6, "
section += "boundary='symmetry','free','symmetry','symmetry','roller','free' /"
half = "'free','free','symmetry','free','roller','free'"
slope = 1 / math.sqrt(2)
cases = {  # bodies, what else, the body met, gap (m)
    "box": (block, {}, 1, 0),
    "above": (block, dict(tip=(0, 0, 6.7e-6)), 1, 0.7e-6),
    "pit": (cut("shape='box', lower=-1e-6,-1e-6,5e-6, upper=4e-6,4e-6,9e-6"), {}, 1, 1e-6),
    "pit_at_its_edge": (cut("shape='box', lower=0,0,5e-6, upper=4e-6,4e-6,9e-6"), {}, 1, 1e-6),
    "ball": (cut("shape='sphere', center=0,0,8e-6, radius=4e-6"), {}, 1, 2e-6),
    "pit_of_a_file": (cut("shape='surface', file='pit.stl'"), {}, 1, 1e-6),
    "cut_elsewhere": (cut("shape='box', lower=5e-6,5e-6,3e-6, upper=9e-6,9e-6,9e-6"), {}, 1, 0),
    "layer_of_a_file": (
        f"{block}\n&body material='a', shape='surface', file='layer.stl', fill='whole' /",
        dict(tip=(0, 0, 8.5e-6)),
        2,
        0.5e-6,
    ),
    "cone": (
        "&body material='a', shape='cone', tip=0,0,6e-6, axis=0,0,1, half_angle=60, height=4e-6 /",
        dict(tip=(0, 0, 6.5e-6)),
        1,
        0.5e-6,
    ),
    "tilted": (
        block.replace("lower=0,0,0", "lower=1e-6,0,0"),
        dict(tip=(4e-6, 0, 8e-6), axis=(1, 0, -1), sides=half, radius=1e-6),
        1,
        2e-6 / slope,
    ),
    "section": (block.replace("8e-6,8e-6", "8e-6,1e-6"), dict(grid=section, tip=(0, 0, 6.2e-6)), 1, 0.2e-6),
    "hole": (ring, {}, 0, 0),
}
runs = {}
for name, (bodies, options, number, gap) in cases.items():
    runs[name] = start_of(name, bodies, **options)
    notes = runs[name].tool().notes
    require(f"{name}: the body", notes["indented_body"] == str(number), notes)
    found = float(notes["surface_gap"])
    check(f"{name}: the gap {found:.6g} m, in cells", (found - gap) / cell, 3e-4)
for name in ("pit", "layer_of_a_file"):
    depth, _ = runs[name].load_depth()
    travel = runs[name].tool()["depth"]
    check(f"{name}: depth below the surface, in cells", (depth - travel + cases[name][3]) / cell, 1e-6)


def refused(name, words, edit=lambda text: text):
    """Whether the depth is refused with these words, when the history's text is edited."""
    path = Path(name) / "tool_tip.dat"
    path.write_text(edit(path.read_text()))
    try:
        found = Run(name).load_depth()[0]
    except Unreadable as error:
        require(f"{name}: {error}", words in str(error) and "\n" not in str(error))
    else:
        require(f"{name}: refused", False, found)


def older(text):
    """A history of a version that does not say where the surface is."""
    return "\n".join(line for line in text.split("\n") if "indented_body" not in line)


refused("hole", "its axis meets no body")
for name in ("pit", "layer_of_a_file", "cone"):
    refused(name, "run the scene again", older)
path = Path("above/tool_tip.dat")
path.write_text(older(path.read_text()))
case = runs["above"].scene
_, gap = indentation.indented_body({"body": case["body"]}, case["tool"][0], History(path))
check("a box, by an older version: the gap is computed, in cells", (gap - 0.7e-6) / cell, 1e-9)
finish()
