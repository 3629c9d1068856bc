"""A picture of an imprint for a talk: the surface that the tool has left, lit from the side and coloured by
its height, beside the load over depth with hardness and modulus.

   gimp3d-post closeup [options] RUN

   --snapshot FILE.hdf   another particle file than the last one
   --heights FACTOR      heights so many times as large as they are (1)

closeup.png   in the directory of the run. What symmetry sides cut off is mirrored back."""

import argparse
import sys
from pathlib import Path

import numpy as np

from . import plots
from .api import Run as WholeRun
from .api import RunFailed
from .plots import plt
from .report_pictures import Surface
from .run_data import Particles, Unreadable, snapshot_paths
from .scene_text import is_flat

reach = 2.6  # of the picture, radii of the contact at its largest
pixels = (1400, 1000)


def heights(run, particles, width):
    """Positions along both sides (m) and heights of the surface (m) within so far of the tool's axis, whole:
    mirrored at symmetry sides."""
    top = Surface(run, particles)
    if top.level is None:
        raise Unreadable(f"{run.directory}: there is no tool that meets a flat surface")
    tip = np.array(run.tools[0]["tip"])[[top.a, top.b]]
    view = []
    for i in (0, 1):
        low, high = top.whole[2 * i : 2 * i + 2]
        view += [max(low, tip[i] - width), min(high, tip[i] + width)]
    seen, extent = top.seen(view)
    if np.any(seen < 0):
        raise Unreadable(f"{run.directory}: the surface has holes near the tool")
    field = (top.top - top.level)[seen]
    sides = [np.linspace(extent[2 * i], extent[2 * i + 1], field.shape[1 - i] + 1) for i in (0, 1)]
    sides = [0.5 * (side[1:] + side[:-1]) for side in sides]
    boundary = run.case["grid"][0].get("boundary", ["free"] * 6)
    lower = run.case["grid"][0]["lower"]
    for i, axis in ((0, top.a), (1, top.b)):
        if boundary[2 * axis] == "symmetry" and abs(extent[2 * i] - lower[axis]) < sides[i][1] - sides[i][0]:
            sides[i] = np.concatenate([2 * lower[axis] - sides[i][::-1], sides[i]])
            field = np.concatenate([np.flip(field, 1 - i), field], axis=1 - i)
    return sides, field


def smooth(field, passes=2):
    """Neighbours' means: what is lit is the shape, not the steps of its particles."""
    for _ in range(passes):
        padded = np.pad(field, 1, mode="edge")
        field = 0.25 * (
            2 * field + 0.5 * (padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:])
        )
    return field


def render(sides, field, factor):
    """The surface as a picture (rows, columns, 3), and the limits of its colours (m)."""
    import vtk
    from matplotlib import colormaps
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)  # it looks for a display first
    shape = smooth(field)
    x, y = np.meshgrid(*sides)
    unit = max(np.ptp(sides[0]), np.ptp(sides[1]))
    grid = vtk.vtkStructuredGrid()
    grid.SetDimensions(len(sides[0]), len(sides[1]), 1)
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(np.stack([x, y, factor * shape], axis=-1).reshape(-1, 3) / unit, deep=True))
    grid.SetPoints(points)
    limit = max(abs(np.percentile(field, [0.5, 99.5])).max(), 1e-30)
    low, high = field.min(), field.max()
    share = (shape - low) / max(high - low, 1e-30)
    colours = (255 * colormaps["viridis"](share)[..., :3]).astype(np.uint8).reshape(-1, 3)
    array = numpy_to_vtk(colours, deep=True)
    array.SetName("colour")
    grid.GetPointData().SetScalars(array)
    surface = vtk.vtkGeometryFilter()
    surface.SetInputData(grid)
    normals = vtk.vtkPolyDataNormals()
    normals.SetInputConnection(surface.GetOutputPort())
    normals.SplittingOff()
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.25)
    actor.GetProperty().SetDiffuse(0.8)
    actor.GetProperty().SetSpecular(0.15)
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.AddActor(actor)
    renderer.AutomaticLightCreationOff()
    for place, power in (((-1.0, -0.6, 0.55), 0.95), ((0.6, -1.0, 1.0), 0.35)):
        light = vtk.vtkLight()
        light.SetLightTypeToSceneLight()
        light.SetPosition(*place)
        light.SetIntensity(power)
        renderer.AddLight(light)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0.55, -1.3, 0.95)
    camera.SetViewUp(0, 0, 1)
    camera.SetFocalPoint(*(0.5 * (s[0] + s[-1]) / unit for s in sides), 0.0)
    camera.SetPosition(*(np.array(camera.GetFocalPoint()) + [0.45, -1.25, 0.95]))
    camera.SetViewAngle(30)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(*pixels)
    window.AddRenderer(renderer)
    renderer.ResetCamera()
    camera.Zoom(1.45)
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    picture = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    picture = picture.reshape(pixels[1], pixels[0], -1)[::-1, :, :3]
    filled = np.argwhere((picture < 250).any(axis=2))
    (top, left), (bottom, right) = filled.min(axis=0), filled.max(axis=0) + 1
    return picture[top:bottom, left:right], (low, high), limit


def bars(found):
    """Hardness and modulus with their uncertainties, as lines."""
    lines = []
    for label, name in (("H", "hardness_true"), ("$E_r$", "modulus_true")):
        if found.get(name) is not None:
            sigma = found.get(f"{name}_uncertainty")
            lines.append(
                f"{label} = {found[name] / 1e9:.2f}"
                + (f" $\\pm$ {sigma / 1e9:.2f}" if sigma else "")
                + " GPa"
            )
    return lines


def draw(run, picture, limits, path):
    found = {}
    try:
        found = WholeRun(run.directory).hardness()
    except RunFailed as failure:
        print(f"closeup: without hardness: {str(failure).splitlines()[0]}", file=sys.stderr)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained", width_ratios=[1.45, 1])
    factor, unit = plots.scaled("m", limits)
    axes[0].imshow(picture)
    axes[0].set_axis_off()
    colours = plt.cm.ScalarMappable(plt.Normalize(*(limit / factor for limit in limits)), "viridis")
    figure.colorbar(colours, ax=axes[0], location="bottom", aspect=45, shrink=0.7, label=f"height [{unit}]")
    depth, load = WholeRun(run.directory).load_depth()
    depth_factor, depth_unit = plots.scaled("m", depth)
    load_factor, load_unit = plots.scaled("N", load)
    axes[1].plot(depth / depth_factor, load / load_factor, color="C0")
    if found.get("stiffness"):
        foot = found["max_depth"] - found["max_load"] / found["stiffness"]
        line = np.array([foot, found["max_depth"]]), np.array([0.0, found["max_load"]])
        axes[1].plot(
            line[0] / depth_factor, line[1] / load_factor, "--", color="C3", label="unloading, slope S"
        )
        axes[1].legend(loc="upper left", frameon=False)
    axes[1].text(0.04, 0.78, "\n".join(bars(found)), transform=axes[1].transAxes, va="top")
    axes[1].set(xlabel=f"depth [{depth_unit}]", ylabel=f"load [{load_unit}]")
    figure.suptitle(run.title)
    plots.save(figure, path)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--snapshot", type=Path)
    parser.add_argument("--heights", type=float, default=1.0)
    options = parser.parse_args()
    try:
        if not options.run.is_dir():
            raise Unreadable(f"{options.run}: no such directory")
        run = plots.Run(options.run)
        if is_flat(run.case["grid"][0]):
            raise Unreadable(
                f"{options.run}: the scene is given by its section, which has no surface to look at; "
                "make paraview shows it, revolved where it is axisymmetric"
            )
        snapshots = snapshot_paths(run.directory)
        history = run.tool_history(run.tools[0]) if run.tools else None
        if not snapshots or history is None:
            raise Unreadable(f"{options.run}: a close-up is of a run with a tool and snapshots")
        share = plots.indentation.share_of_body(history)
        radius = np.sqrt(np.nanmax(history["contact_area"]) / share / np.pi)
        if not radius > 0:
            raise Unreadable(f"{options.run}: the tool has touched nothing")
        particles = Particles(options.snapshot or snapshots[-1])
        sides, field = heights(run, particles, reach * radius)
        picture, limits, _ = render(sides, field, options.heights)
        draw(run, picture, limits, options.run / "closeup.png")
    except (Unreadable, KeyError) as error:
        print(f"closeup: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
