"""The scene that post/gimp3d/paraview_scene.py makes of a run of paraview_scene.nml: what it draws, at each
snapshot, against formulas.

pvpython paraview_scene.py RUN...
pvpython paraview_scene.py --rings RUN           of a section: vectors and tensors go round with the rings
pvpython paraview_scene.py --load STATE PICTURE   only draws a state that was written (needs a display)
"""

import math
import os
import sys
from pathlib import Path

import numpy as np
from paraview import simple
from vtkmodules.util.numpy_support import vtk_to_numpy

import checks
from gimp3d import paraview_scene

# A programmable filter puts numpy's names in the place of those of this script that are the same (ParaView
# 5.11: min, require and near were other functions after the first one): so checks.require, not require.
# Of the tools at a time, m.
TRAVEL = {
    "sphere": lambda t: 20 * t,
    "large": lambda t: 10 * t,
    "cone": lambda t: 1000 * t**2 if t < 0.01 else 20 * t - 0.1,
    "flat": lambda t: 20 * t,
    "berkovich": lambda t: 20 * t,
    "roller": lambda t: 20 * t,
    "wedge": lambda t: 0,
}


def near(values, expected, tolerance, sentence):
    values, expected = np.broadcast_arrays(values, expected)
    off = np.abs(values - expected).max() if values.size else np.inf
    checks.require(f"{sentence}: off by {off:.3g}", off <= tolerance)


def off_surface(name, across, height):
    """How far points are off the surface of a tool (m): by their place across the axis and their height above
    the tip."""
    r = np.linalg.norm(across, axis=1)
    if name in ("sphere", "large"):
        radius = {"sphere": 2, "large": 40}[name]
        return np.hypot(r, radius - height) - radius
    if name == "cone":
        return height * math.tan(math.radians(60)) - r
    if name == "flat":
        return np.where(height > 1e-9, r - 3, np.maximum(r - 3, 0))
    if name == "roller":
        return np.hypot(across @ np.array([1, -1, 0]) / math.sqrt(2), 1.5 - height) - 1.5
    if name == "wedge":
        return height - np.abs(across[:, 0]) / math.tan(math.radians(50))
    # of the pyramid's faces, seen along the axis
    first = np.arctan2(2, 1) + np.array([0, 2, 4]) * math.pi / 3
    faces = across[:, :2] @ np.array([np.cos(first), np.sin(first)])
    return height - faces.max(axis=1) / math.tan(math.radians(65.27))


def check_tool(name, tool, proxy, time):
    grid = paraview_scene.leaf(proxy)
    points = vtk_to_numpy(grid.GetPoints().GetData())
    axis = np.array(tool.get("axis", [0, 0, -1]), dtype=float)
    axis /= np.linalg.norm(axis)
    way = points - np.array(tool["tip"]) - TRAVEL[name](time) * axis
    height = -way @ axis
    where = f"{name} at {time:g} s"
    checks.require(f"{where} is inside the symmetry sides: {points.min(axis=0)}", points[:, :2].min() > -1e-6)
    near(height.min(), 0, 1e-6, f"{where}: its tip")
    checks.require(f"{where}: is {height.max()} m high", height.max() > 0.4)
    # rounded surfaces are cut where their flat pieces are
    near(
        off_surface(name, way + height[:, None] * axis, height),
        0,
        1e-5 if name in ("berkovich", "wedge") else 0.012,
        where,
    )


def check_particles(scene, time):
    snapshot = paraview_scene.leaf(scene.snapshots)
    grid = paraview_scene.leaf(scene.particles)
    points, cells = snapshot.GetPointData(), grid.GetCellData()
    checks.require(
        f"{grid.GetNumberOfCells()} cells", grid.GetNumberOfCells() == snapshot.GetNumberOfPoints() > 100
    )
    names = sorted(points.GetArrayName(n) for n in range(points.GetNumberOfArrays()))
    checks.require(
        "fields of the cells",
        names == sorted(cells.GetArrayName(n) for n in range(cells.GetNumberOfArrays())),
    )
    for name in names:
        near(
            vtk_to_numpy(cells.GetArray(name)),
            vtk_to_numpy(points.GetArray(name)),
            0,
            f"{name} at {time:g} s",
        )
    corners = vtk_to_numpy(grid.GetPoints().GetData()).reshape(-1, 8, 3)
    near(corners.mean(axis=1), vtk_to_numpy(snapshot.GetPoints().GetData()), 1e-5, f"centres at {time:g} s")
    if "half_size" in names:
        half = vtk_to_numpy(points.GetArray("half_size")).reshape(len(corners), -1)
        near(np.ptp(corners, axis=1), 2 * half, 1e-9, f"edges at {time:g} s")
        return
    edges = (corners[:, [1, 3, 4]] - corners[:, :1]) / 2
    near(edges, vtk_to_numpy(points.GetArray("domain")).reshape(-1, 3, 3), 1e-6, f"half edges at {time:g} s")
    sizes = simple.CellSize(Input=scene.particles, ComputeVertexCount=0, ComputeLength=0, ComputeArea=0)
    sizes.UpdatePipeline(time)
    volume = vtk_to_numpy(paraview_scene.leaf(sizes).GetCellData().GetArray("Volume"))
    near(volume / vtk_to_numpy(points.GetArray("volume")), 1, 1e-5, f"volumes at {time:g} s")


def check_run(directory):
    print(directory)
    run = paraview_scene.Run(Path(directory))
    checks.require(f"{len(run.times)} snapshots", len(run.times) == 3)
    scene = paraview_scene.Scene(run)
    tools = {tool["name"][0]: tool for tool in run.case.get("tool", [])}
    checks.require(f"tools {list(scene.tools)}", list(scene.tools) == list(tools))
    for time in run.times.values():
        scene.particles.UpdatePipeline(time)
        check_particles(scene, time)
        for name, drawn in scene.tools.items():
            if drawn is not None:
                drawn.UpdatePipeline(time)
                check_tool(name, tools[name], drawn, time)


def check_rings(directory):
    print(directory)
    scene = paraview_scene.Scene(paraview_scene.Run(Path(directory)))
    points, grid = (paraview_scene.leaf(part) for part in (scene.snapshots, scene.particles))
    points, cells = points.GetPointData(), grid.GetCellData()
    n = points.GetArray("velocity").GetNumberOfTuples()
    pieces = grid.GetNumberOfCells() // n
    corners = vtk_to_numpy(grid.GetPoints().GetData()).reshape(n, pieces + 1, 4, 3)
    radial = (corners[:, 1:] + corners[:, :-1]).mean(axis=2) * [1, 1, 0]
    radial /= np.linalg.norm(radial, axis=2)[..., None]
    around = np.stack([-radial[..., 1], radial[..., 0], 0 * radial[..., 0]], axis=2)
    axes = np.stack([radial, around, 0 * radial + [0, 0, 1]], axis=2)
    velocity = vtk_to_numpy(cells.GetArray("velocity")).reshape(n, pieces, 3)
    of_section = vtk_to_numpy(points.GetArray("velocity"))
    checks.require("the section moves along its radius", np.abs(of_section[:, 0]).max() > 1)
    near(np.einsum("npai,npi->npa", axes, velocity), of_section[:, None], 1e-3, "velocities")
    order = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
    stress = vtk_to_numpy(cells.GetArray("stress")).reshape(n, pieces, 6)[..., order]
    of_section = vtk_to_numpy(points.GetArray("stress"))[:, None, order]
    scale = np.abs(of_section).max()
    near(np.einsum("npai,npij,npbj->npab", axes, stress, axes) / scale, of_section / scale, 1e-5, "stresses")
    edges = vtk_to_numpy(cells.GetArray("domain")).reshape(n, pieces, 3, 3)
    of_section = vtk_to_numpy(points.GetArray("domain")).reshape(n, 1, 3, 3)
    near(np.einsum("npai,npki->npka", axes, edges), of_section, 1e-9, "domains")


def main():
    if sys.argv[1] == "--load":
        simple.LoadState(sys.argv[2])
        simple.SaveScreenshot(sys.argv[3], simple.GetActiveView(), ImageResolution=[1200, 900])
        return 0
    check, runs = (check_rings, sys.argv[2:]) if sys.argv[1] == "--rings" else (check_run, sys.argv[1:])
    for directory in runs:
        check(directory)
        simple.ResetSession()
    print(f"{len(checks.faults)} wrong")
    return 1 if checks.faults else 0


status = main()
sys.stdout.flush()
os._exit(status)
