"""Tools from files against the same tools by their formulas: the load of a ball and of a cone whose facets
are a quarter of a cell, on one and two ranks; a tool that is turned and scaled; the overlap of a concave one.
Pictures of them: sections and tools.xdmf. usage: surfaces.py (in an empty directory; GIMP3D is the
program)"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

ROOT = Path(__file__).resolve().parents[2]
from gimp3d import surfaces
from gimp3d import tool_surface
from gimp3d.run_data import History, read_namelists
from run_scene import run
from checks import check, finish, require

SCENE = """&scene title='press', end_time=0.24 /
&grid lower=0,0,0, upper=9,9,8, cell_size=1, boundary='symmetry','free','symmetry','free','roller','free' /
&material name='m', model='elastic', density=1, young=2000, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=7,7,6 /
&tool name='t', {tool}, times=0,0.08, speeds=0,6, axis=0,0,-1 /
&output directory='{name}', every=0.12, history_every=1e-3 /
"""


def load(name, tool, ranks=1):
    run(SCENE.format(name=name, tool=tool), ranks)
    history = History(Path(name) / "tool_t.dat")
    late = history["time"] > 0.12
    return history["load_z"][late]


surfaces.write("ball.stl", surfaces.sphere(6.0, 0.25))
surfaces.write("cone.obj", surfaces.cone(70.0, 2.0, 0.25))
turned = surfaces.cone(70.0, 2.0, 0.25)[:, :, [2, 1, 0]] * [-500, 500, 500]  # along x, in another unit
surfaces.write("turned.stl", turned)
loads = {
    "ball": load("ball", "shape='sphere', radius=6, tip=0,0,6"),
    "ball_file": load("ball_file", "shape='surface', file='ball.stl', tip=0,0,6"),
    "cone": load("cone", "shape='cone', half_angle=70, tip=0,0,6"),
    "cone_file": load("cone_file", "shape='surface', file='cone.obj', tip=0,0,6"),
    "cone_two": load("cone_two", "shape='surface', file='cone.obj', tip=0,0,6", 2),
    "cone_turned": load(
        "cone_turned", "shape='surface', file='turned.stl', scale=2e-3, rotation=0,90,0, tip=0,0,6"
    ),
}
for kind in ("ball", "cone"):
    off = loads[f"{kind}_file"].mean() / loads[kind].mean() - 1
    check(
        f"{kind}: load of the one from a file against that of the formula, over the second half", off, 0.005
    )
check(
    "cone: on two ranks against one, over the largest",
    (loads["cone_two"] - loads["cone_file"]) / loads["cone_file"].max(),
    1e-6,
)
check(
    "cone: turned and scaled (in 32 bits) against as it is",
    (loads["cone_turned"] - loads["cone_file"]) / loads["cone_file"].max(),
    1e-4,
)

# what is drawn of the two must lie on the formula, where the history has them
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

for name in ("ball", "ball_file"):
    written = tool_surface.write(Path(name))
    reader = vtkXdmfReader()
    reader.SetFileName(str(written[0]))
    reader.UpdateInformation()
    steps = reader.GetOutputInformation(0).Get(
        __import__(
            "vtkmodules.vtkCommonExecutionModel", fromlist=["x"]
        ).vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    )
    require(f"{name}: as many times as snapshots", len(steps) == 3)
    reader.UpdateTimeStep(steps[-1])
    grid = reader.GetOutputDataObject(0)
    places = np.array([grid.GetPoint(i) for i in range(grid.GetNumberOfPoints())])
    history = History(Path(name) / "tool_t.dat")
    middle = np.array([0, 0, 6.0 + 6.0 - np.interp(steps[-1], history["time"], history["depth"])])
    check(
        f"{name}: tools.xdmf against the sphere, over its radius",
        np.linalg.norm(places - middle, axis=1) / 6 - 1,
        5e-3,
    )
    case = read_namelists(Path(name) / "case.nml")
    found = tool_surface.triangles(case["tool"][0], 10.0)
    cut = tool_surface.section(found, 1, 0.3).reshape(-1, 3) - [0, 0, 12]
    check(
        f"{name}: its section against the circle",
        np.hypot(cut[:, 0], cut[:, 2]) / np.sqrt(36 - 0.09) - 1,
        5e-3,
    )
for tool in (
    "'cone', half_angle=40, tip_radius=1",
    "'flat', radius=2",
    "'cylinder', radius=2",
    "'wedge', half_angle=40",
    "'profile', radii=0.2,1,1.5, heights=0,1,3",
    "'berkovich'",
    "'pyramid', faces=4, half_angle=68",
):
    Path("made.nml").write_text(f"&tool name='x', shape={tool}, tip=1,2,3, axis=0,0,-1 /\n")
    found = tool_surface.triangles(read_namelists(Path("made.nml"))["tool"][0], 5.0)
    require(f"{tool}: drawn above its tip", len(found) > 1 and abs(found[:, :, 2].min() - 3) < 1e-9)
for faces, angle in ((3, 65.27), (4, 40.0)):
    turns, half = 2 * np.pi * np.arange(faces) / faces, np.radians(angle)
    normals = np.stack(
        [np.cos(half) * np.cos(turns), np.cos(half) * np.sin(turns), np.full(faces, -np.sin(half))]
    )
    lines = tool_surface.pyramid_lines(faces, half, 0.7, 5.0)
    # a place less its nearest point of a convex cone is the nearest point of the cone of its normals
    distance = [
        np.linalg.norm(normals @ nnls(normals, place - [0, 0, 0.7])[0]) for place in lines.reshape(-1, 3)
    ]
    check(
        f"a rounded pyramid of {faces} faces as it is drawn: distance from the sharp one over the radius",
        np.array(distance) / 0.7 - 1,
        1e-9,
    )
    require(
        f"a rounded pyramid of {faces} faces: its tip is the origin",
        np.abs(lines[0]).max() < 1e-15 and lines[1:, :, 2].min() > 0,
    )

# a hollow one: a block fits into it, and is refused where it does not
surfaces.write("die.stl", surfaces.die(3.0, 2.0, 6.0, 20.0, 1.0, 0.3))
text = """&scene title='hollow', end_time=1e-3 /
&grid lower=-8,-8,-8, upper=8,8,8, cell_size=1 /
&material name='m', model='elastic', density=1, young=2000, poisson=0.3 /
&body name='rod', material='m', shape='cylinder', center=0,0,{z}, radius=2.5, height=4 /
&tool name='die', shape='surface', file='die.stl', tip=0,0,0, times=0, speeds=0 /
"""
run(text.format(z=1.6), 1)
said = run(text.format(z=0), 1, (2,))
require(
    "a rod in the wall of a die is refused",
    "the tool die starts inside the body rod on line 4 and reaches about 0.37 m into it" in said,
)
done = subprocess.run([sys.executable, "-m", "gimp3d", "plots", "ball_file"], capture_output=True, text=True)
require(
    "plots.py draws a run with a tool from a file",
    done.returncode == 0 and Path("ball_file/section.png").is_file(),
)
finish()
