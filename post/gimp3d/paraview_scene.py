#!/usr/bin/env pvpython
"""A run as a scene of ParaView: particles in their shape and size, coloured by von Mises stress, with tools
and boxes of levels.

   gimp3d-post paraview [options] RUN

paraview.pvsm   the state: `paraview RUN/paraview.pvsm` opens it, animated over the snapshots
paraview.png    its picture at the last snapshot, drawn without a window (on a machine without a display:
xvfb-run -a pvpython ...)

   --frames       a picture of every snapshot too, paraview_<step>.png
   --no-picture   the state alone, which needs no display

A particle is the parallelepiped of its `domain`, or the box of its `half_size`; of an axisymmetric scene the
ring of these, a quarter of which is left open. The stress is the recovered
one where the run has it. Tools without an end are drawn as far as half the size of the body; all are cut at
symmetry sides. Pyramids and tools from files are shown from tools.xdmf (tool_surface.py), whole. Exit
status 2, and one sentence, if the run is not one that can be drawn."""

import argparse
import json
import math
import os
import sys
from pathlib import Path

try:
    from paraview import servermanager, simple
except ImportError:
    print(
        "paraview_scene.py is for ParaView's own Python, pvpython: gimp3d-post paraview RUN (apt-get "
        "install paraview"
        " python3-paraview)",
        file=sys.stderr,
    )
    sys.exit(2)
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkRenderingCore import vtkRenderWindow

from gimp3d.indentation import unit_axis
from gimp3d.run_data import History, Unreadable, read_namelists

# Programmable filters of ParaView: what follows is kept in the state, and runs wherever that is opened.
GRID = """
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonDataModel import vtkCellArray

def make(points, cells, kind):
    output.Points = np.ascontiguousarray(points)
    array = vtkCellArray()
    numbers = np.ascontiguousarray(cells, dtype=np.int64).ravel()
    array.SetData(cells.shape[1], numpy_to_vtkIdTypeArray(numbers, deep=1))
    output.VTKObject.SetCells(kind, array)
"""

DOMAINS = (
    GRID
    + """
fields, centre = inputs[0].PointData, np.asarray(inputs[0].Points)
n = len(centre)
if "domain" in fields.keys():
    # half edge k is row k; VTK's numpy_interface gives nine components as the transpose of that
    edges = np.asarray(fields["domain"]).reshape(n, 3, 3).transpose(0, 2, 1)
else:
    edges = np.asarray(fields["half_size"]).reshape(n, -1, 1) * np.eye(3)
"""
)

PARTICLES = (
    DOMAINS
    + """
square = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
signs = np.array([(x, y, z) for z in (-1, 1) for x, y in square])
corners = centre[:, None] + np.einsum("ck,nki->nci", signs, edges)
make(corners.reshape(-1, 3), np.arange(8 * n).reshape(-1, 8), 12)
for name in fields.keys():
    output.CellData.append(fields[name], name)
"""
)

# Of the section of a body of revolution: each particle's quadrilateral as a ring about the z axis, open
# towards the view, in so many pieces; what would lie beyond the axis is drawn in to it. Vectors and tensors,
# whose components in a section are along the radius, the circumference and the axis, are rotated with each
# piece: 3 components but edge lengths; xx yy zz yz xz xy; three half edges; matrices.
RINGS = (
    DOMAINS
    + """
signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
corners = centre[:, None] + np.einsum("ck,nki->nci", signs, edges[:, [0, 2]])
radius, height = np.maximum(corners[..., 0], 0), corners[..., 2]
pieces = int(np.clip({most} // (n or 1), 12, 54))
angle = np.linspace({start}, {stop}, pieces + 1)[None, :, None]
x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
points = np.stack(np.broadcast_arrays(x, y, height[:, None]), axis=-1)
first = 4 * (np.arange(n)[:, None] * (pieces + 1) + np.arange(pieces)[None, :]).reshape(-1, 1)
make(points.reshape(-1, 3), first + np.arange(8), 12)
middle = 0.5 * (angle[0, 1:, 0] + angle[0, :-1, 0])
zero, one = 0 * middle, 0 * middle + 1
rotation = np.array([[np.cos(middle), -np.sin(middle), zero], [np.sin(middle), np.cos(middle), zero],
                     [zero, zero, one]])
order = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]]) # of the six components in a matrix
for name in fields.keys():
    values = np.asarray(fields[name])
    components = values.size // (n or 1)
    if components == 3 and name != "half_size":
        rotated = np.einsum("ijp,nj->npi", rotation, values)
    elif components == 6:
        rotated = np.einsum("iap,nab,jbp->npij", rotation, values[:, order], rotation)
        rotated = rotated[..., [0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
    elif name == "domain":
        rotated = np.einsum("ijp,nkj->npki", rotation, edges)
    elif components == 9:
        rotated = np.einsum("iap,nba,jbp->npij", rotation, values, rotation)
    else:
        rotated = np.repeat(values, pieces, axis=0)
    output.CellData.append(np.ascontiguousarray(rotated).reshape(-1, components).squeeze(), name)
"""
)
RING_PIECES, RING_START, RING_STOP = 2_000_000, -0.5 * math.pi, math.pi  # cells at most; rad

TOOL = (
    GRID
    + """
history = np.loadtxt({path!r}, ndmin=2, comments=["TITLE", "VARIABLES", "ZONE", "AUXDATA"])
at = [np.interp(inputs[0].FieldData["TimeValue"][0], history[:, 0], column) for column in history.T]
tip, axis = np.array({tip}), np.array({axis})
radius, height = np.array({profile}).T # of the profile: its distance from the axis, and from the tip against the axis
ways, shifts = np.array({ways}), np.array({shifts}) # where it goes: directions of the distance, and a shift of the whole
points = tip - height[:, None, None] * axis + radius[:, None, None] * ways + shifts # at the start
if len(at) < 14: # of an older version, whose tools move along their axis alone
    points = points + at[1] * axis
else: # where its point has gone, turned about it
    turn, arm = np.array(at[10:14]) / np.linalg.norm(at[10:14]), points - history[0, 7:10]
    points = at[7:10] + arm + 2 * np.cross(turn[1:], np.cross(turn[1:], arm) + turn[0] * arm)
number = np.arange(points.size // 3).reshape(points.shape[:2])
cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
make(points.reshape(-1, 3), cells, 9)
"""
)


def surface(tool, reach):
    """The surface of a tool as a profile that is turned about the axis, or moved along a line: points of it
    (distance from the axis, height above the tip; m), and for each place that it is put to the direction of
    the distance and a shift (m). Tools without an end reach that far (m). None for a shape that is not known
    here."""
    axis, shape = unit_axis(tool), tool["shape"][0]
    edge = np.array(tool.get("edge", [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0]))
    edge = edge - edge.dot(axis) * axis
    edge /= np.linalg.norm(edge)
    across = np.cross(axis, edge)
    slope = math.tan(math.radians(tool["half_angle"][0])) if "half_angle" in tool else None
    arc = np.linspace(0, math.pi, 65)[:, None]
    round_ways = np.cos(2 * arc) * edge + np.sin(2 * arc) * across
    along = np.array([-reach * edge, reach * edge])
    if shape in ("sphere", "cylinder"):
        radius = tool["radius"][0]
        arc = arc * math.asin(min(1, reach / radius)) / math.pi if radius > reach else arc
        profile = radius * np.hstack([np.sin(arc), 1 - np.cos(arc)])
        if shape == "sphere":
            return profile, round_ways, np.zeros((65, 3))
        return np.vstack([profile[:0:-1] * [-1, 1], profile]), np.array([across, across]), along
    if shape == "flat":
        radius = min(tool["radius"][0], 3 * reach)
        return np.array([[0, 0], [radius, 0], [radius, reach / 2]]), round_ways, np.zeros((65, 3))
    if shape == "profile":
        return np.array([tool["radii"], tool["heights"]]).T, round_ways, np.zeros((65, 3))
    if shape == "cone":
        return np.array([[0, 0], [reach, reach / slope]]), round_ways, np.zeros((65, 3))
    if shape == "wedge":
        return (
            np.array([[-reach, reach / slope], [0, 0], [reach, reach / slope]]),
            np.array([across, across]),
            along,
        )
    if shape == "berkovich":  # corners lie opposite to the middles of the faces, twice as far from the axis
        turn = math.pi * np.array([1, 3, 5, 7])[:, None] / 3
        return (
            np.array([[0, 0], [reach, reach / (2 * slope)]]),
            np.cos(turn) * edge + np.sin(turn) * across,
            np.zeros((4, 3)),
        )
    return None


class Run:
    """What a run has written: `case` (its scene), the times of its snapshots (s) by step, the names of their
    fields."""

    def __init__(self, directory):
        self.directory = directory
        if not directory.is_dir():
            raise Unreadable(f"{directory}: no such directory")
        for name in ("case.nml", "particles.hdf.series"):
            if not (directory / name).is_file():
                raise Unreadable(f"{directory}: there is no {name}: no run has written HDF5 snapshots there")
        self.case = read_namelists(directory / "case.nml")
        self.series = directory / "particles.hdf.series"
        self.times = {
            int(file["name"].split("_")[1].split(".")[0]): file["time"]
            for file in json.loads(self.series.read_text())["files"]
        }
        if not self.times:
            raise Unreadable(f"{directory}: the run has not written a snapshot yet")

    def geometry(self):
        """3d, axisymmetric or plane_strain."""
        return self.case["grid"][0].get("geometry", ["3d"])[0].lower()

    def sides(self):
        """For each axis, whether the grid's lower and upper side are symmetry planes, and where these are
        (m). None where a section is revolved."""
        grid = self.case["grid"][0]
        if self.geometry() == "axisymmetric":
            return [((False, grid["lower"][i]), (False, grid["upper"][i])) for i in range(3)]
        kinds = [kind == "symmetry" for kind in grid["boundary"]]
        return [((kinds[2 * i], grid["lower"][i]), (kinds[2 * i + 1], grid["upper"][i])) for i in range(3)]


def leaf(proxy):
    """The grid in what a filter gave."""
    data = servermanager.Fetch(proxy)
    if not hasattr(data, "NewIterator"):
        return data
    return data.NewIterator().GetCurrentDataObject()


class Scene:
    """The pipeline, and the view that shows it at the last snapshot: `particles`, `tools` and `levels` are
    its sources."""

    def __init__(self, run):
        self.run, self.last = run, list(run.times.values())[-1]
        self.snapshots = simple.OpenDataFile(str(run.series.resolve()))
        simple.RenameSource("snapshots", self.snapshots)
        self.animation = simple.GetAnimationScene()
        self.animation.UpdateAnimationUsingDataTimeSteps()
        self.animation.AnimationTime = self.last  # while there is no view: a change of it draws all there are
        self.view = simple.CreateView("RenderView")
        self.view.ViewSize = [1200, 900]
        self.view.UseColorPaletteForBackground = 0
        self.view.Background = [1.0, 1.0, 1.0]
        self.view.OrientationAxesLabelColor = [0.0, 0.0, 0.0]
        self.round = run.geometry() == "axisymmetric"
        self.draw_particles()
        self.others = None
        reach = 0.5 * (self.bounds[:, 1] - self.bounds[:, 0]).max()
        self.tools = {tool["name"][0]: self.draw_tool(tool, reach) for tool in run.case.get("tool", [])}
        self.levels = self.draw_levels()
        self.write_time()
        self.look()

    def draw_particles(self):
        self.snapshots.UpdatePipeline(self.last)
        names = self.snapshots.PointData.keys()
        self.field = next((name for name in ("von_mises_recovered", "von_mises") if name in names), None)
        if self.field is None:
            raise Unreadable(
                f"{self.run.directory}: its snapshots have no von_mises; they have {', '.join(names)}"
            )
        self.particles = simple.ProgrammableFilter(
            registrationName="particles",
            Input=self.snapshots,
            Script=RINGS.format(most=RING_PIECES, start=RING_START, stop=RING_STOP)
            if self.round
            else PARTICLES,
            OutputDataSetType="vtkUnstructuredGrid",
        )
        self.particles.UpdatePipeline(self.last)
        grid = leaf(self.particles)
        if grid.GetNumberOfCells() == 0:
            raise Unreadable(f"{self.run.directory}: its last snapshot holds no particles")
        self.bounds = np.array(grid.GetBounds()).reshape(3, 2)
        shown = simple.Show(self.particles, self.view)
        shown.Ambient, shown.Diffuse = 0.4, 0.6  # faces in the shade keep their colour
        simple.ColorBy(shown, ("CELLS", self.field))
        # the same colours at all times; without the few extremes at the rim of a contact
        largest = np.percentile(vtk_to_numpy(grid.GetCellData().GetArray(self.field)), 99.8)
        colours = simple.GetColorTransferFunction(self.field)
        colours.ApplyPreset("Viridis (matplotlib)", True)
        colours.RescaleTransferFunction(0.0, largest if largest > 0 else 1.0)
        colours.AutomaticRescaleRangeMode = "Never"
        bar = simple.GetScalarBar(colours, self.view)
        bar.Title, bar.ComponentTitle = (
            f"{self.field.replace('_', ' ').replace('von mises', 'von Mises stress')} [Pa]",
            "",
        )
        bar.TitleColor = bar.LabelColor = [0.0, 0.0, 0.0]
        shown.SetScalarBarVisibility(self.view, True)

    def draw_tool(self, tool, reach):
        """The tool where its history has it at each time, cut at symmetry sides; None, with a word, for what
        cannot be drawn."""
        name = tool["name"][0]
        path = (self.run.directory / f"tool_{name}.dat").resolve()
        made = surface(tool, reach)
        if made is None and (self.run.directory / "tools.xdmf").is_file():
            return self.draw_other_tools()
        if made is None or not path.is_file() or History(path).rows == 0:
            why = (
                f"there is no {path.name} with a row"
                if made is not None
                else f"for shape {tool['shape'][0]!r} gimp3d-post tool_surface must have written tools.xdmf"
            )
            print(f"the tool {name} is not drawn: {why}", file=sys.stderr)
            return None
        profile, ways, shifts = (array.tolist() for array in made)
        script = TOOL.format(
            path=str(path),
            tip=list(tool["tip"]),
            axis=unit_axis(tool).tolist(),
            profile=profile,
            ways=ways,
            shifts=shifts,
        )
        drawn = simple.ProgrammableFilter(
            registrationName=f"tool {name}",
            Input=self.snapshots,
            Script=script,
            OutputDataSetType="vtkUnstructuredGrid",
            CopyArrays=0,
        )
        for i, sides in enumerate(self.run.sides()):
            for (held, place), way in zip(sides, (1.0, -1.0)):
                if held:
                    drawn = simple.Clip(
                        registrationName=f"{name} beyond {'xyz'[i]} = {place:g} m",
                        Input=drawn,
                        ClipType="Plane",
                        Invert=0,
                    )
                    drawn.ClipType.Origin = [place if i == j else 0.0 for j in range(3)]
                    drawn.ClipType.Normal = [way if i == j else 0.0 for j in range(3)]
        shown = simple.Show(drawn, self.view)
        shown.ColorArrayName = ["POINTS", ""]  # one colour
        shown.DiffuseColor = shown.AmbientColor = [0.55, 0.57, 0.6]
        shown.Opacity = 0.5
        # on the screen just above the faces that it presses
        shown.Position = (-2e-4 * reach * unit_axis(tool)).tolist()
        return drawn

    def draw_other_tools(self):
        """All tools as triangles, as post/gimp3d/tool_surface.py has written them for each snapshot; once."""
        if self.others is None:
            self.others = simple.OpenDataFile(str(self.run.directory.resolve() / "tools.xdmf"))
            simple.RenameSource("tools", self.others)
            shown = simple.Show(self.others, self.view)
            simple.ColorBy(shown, None)
            shown.DiffuseColor = shown.AmbientColor = [0.55, 0.57, 0.6]
            shown.Opacity = 0.5
        return self.others

    def draw_levels(self):
        path = self.run.directory.resolve() / "levels.xdmf"
        if not path.is_file():
            return None
        levels = simple.OpenDataFile(str(path))
        simple.RenameSource("levels", levels)
        shown = simple.Show(levels, self.view)
        shown.Representation, shown.LineWidth = "Wireframe", 2.0
        simple.ColorBy(shown, ("CELLS", "level"))
        colours = simple.GetColorTransferFunction("level")
        colours.ApplyPreset("Inferno (matplotlib)", True)
        if self.round:  # on the open face of the revolved section
            shown.Scale = [-1.0, -1e-3, 1.0]
        shown.SetScalarBarVisibility(self.view, False)
        return levels

    def write_time(self):
        words = {"axisymmetric": ", section revolved by 270 degrees", "plane_strain": ", plane strain"}
        text = "{time:g} s" + words.get(self.run.geometry(), "")
        time = simple.AnnotateTimeFilter(registrationName="time", Input=self.snapshots, Format=text)
        shown = simple.Show(time, self.view)
        shown.Color, shown.FontSize, shown.WindowLocation = [0.0, 0.0, 0.0], 20, "Upper Left Corner"

    def look(self):
        """From where the first tool comes, into the symmetry sides, where the body is cut open; without
        perspective."""
        tools = self.run.case.get("tool", [])
        up = -unit_axis(tools[0]) if tools else np.array([0.0, 0.0, 1.0])
        vertical = int(np.argmax(np.abs(up)))
        flat = [i for i in range(3) if i != vertical]
        cut = {i: [self.round or held for held, _ in self.run.sides()[i]] for i in flat}
        way = np.zeros(3)
        for i in flat:
            way[i] = -1.0 if cut[i][0] else 1.0 if cut[i][1] else 0.0
        open_ways = [i for i in flat if way[i] == 0]
        if len(open_ways) == 2:
            way[flat] = 0.6, -1.0
        elif open_ways:
            way[open_ways[0]] = 0.4
        way += 0.5 * up
        way /= np.linalg.norm(way)
        right = np.cross(up, way)
        right /= np.linalg.norm(right)
        above = np.cross(way, right)
        corners = np.array([[self.bounds[i, bit >> i & 1] for i in range(3)] for bit in range(8)])
        middle = self.bounds.mean(axis=1)
        width, height = (np.ptp(corners @ direction) for direction in (right, above))
        self.view.CameraParallelProjection = 1
        self.view.CameraFocalPoint = middle.tolist()
        self.view.CameraPosition = (middle + 3 * np.linalg.norm(np.ptp(self.bounds, axis=1)) * way).tolist()
        self.view.CameraViewUp = above.tolist()
        self.view.CameraParallelScale = 0.65 * max(
            height, width * self.view.ViewSize[1] / self.view.ViewSize[0]
        )
        size = np.cbrt(
            np.prod(np.ptp(self.bounds, axis=1)) / self.particles.GetDataInformation().GetNumberOfCells()
        )
        # pixels that a particle takes
        if size > 12 * 2 * self.view.CameraParallelScale / self.view.ViewSize[1]:
            shown = simple.GetRepresentation(self.particles, self.view)
            shown.Representation, shown.EdgeColor = "Surface With Edges", [0.2, 0.2, 0.2]

    def picture(self, path, time):
        """A picture of a time, complete or not there."""
        partial = path.with_name(f".part.{path.name}")
        self.animation.AnimationTime = time
        simple.SaveScreenshot(str(partial), self.view, ImageResolution=list(self.view.ViewSize))
        os.replace(partial, path)
        print(path)

    def state(self, path):
        partial = path.with_name(f".part.{path.name}")
        simple.SaveState(str(partial))
        os.replace(partial, path)
        print(path)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--frames", action="store_true")
    parser.add_argument("--no-picture", action="store_true")
    options = parser.parse_args()
    try:
        run = Run(options.run)
        if (
            not options.no_picture
            and vtkRenderWindow().IsA("vtkXOpenGLRenderWindow")
            and not os.environ.get("DISPLAY")
        ):
            raise Unreadable(
                "there is no display to draw a picture on: take --no-picture, or say xvfb-run -a before "
                "pvpython"
                " (apt-get install xvfb xauth)"
            )
        scene = Scene(run)
        scene.state(run.directory / "paraview.pvsm")
        if options.no_picture:
            return 0
        if options.frames:
            for step, time in run.times.items():
                scene.picture(run.directory / f"paraview_{step:08d}.png", time)
        scene.picture(run.directory / "paraview.png", scene.last)
    except Unreadable as error:
        print(error, file=sys.stderr)
        return 2
    except (KeyError, IndexError, ValueError) as error:
        print(f"{options.run}: what the run wrote lacks {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    from gimp3d import (
        paraview_scene,
    )  # programmable filters put names of their own into __main__, `max` is one

    status = paraview_scene.main()
    sys.stdout.flush()
    os._exit(status)  # in an orderly exit ParaView 5.11 crashes, or its HDF5 complains
