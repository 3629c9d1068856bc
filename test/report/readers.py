"""What programs of others show of the files of a run. usage: readers.py RUN DOCUMENT [--table]

Each is opened by its own name, and what is shown is compared with what h5py and the histories say. What is
not installed is named and left out. With --table the rows of the document are printed, not compared."""

import importlib.metadata
import math
import re
import shutil
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import h5py
import numpy as np

from gimp3d.instrument_file import hld_text
from gimp3d.run_data import History, Particles, snapshot_paths

run, document = Path(sys.argv[1]), Path(sys.argv[2])
snapshots = snapshot_paths(run)
last = Particles(snapshots[-1])
times = [Particles(path).time for path in snapshots]
outline = sorted(run.glob("outline_*.dat"))[-1]


def need(holds, what):
    if not holds:
        raise AssertionError(what)


def same_particles(points, stress=None, tolerance=1e-6):
    """`points` (and `stress`, in VTK's order) are those of the last snapshot, to single precision."""
    points, exact = np.asarray(points), last["position"]
    need(points.shape == exact.shape, f"{points.shape} points for {exact.shape}")
    need(abs(points - exact).max() <= tolerance * abs(exact).max(), "the points are others")
    if stress is not None:
        known = last["stress"][:, [0, 1, 2, 5, 3, 4]]
        need(abs(np.asarray(stress) - known).max() <= tolerance * abs(known).max(), "the stress is another")


# ---- PyVista ----


def pyvista_read(name):
    import pyvista

    return pyvista.read(run / name)


def pyvista_snapshot():
    mesh = pyvista_read(snapshots[-1].name)
    same_particles(mesh.points, mesh["stress"], 1e-12)
    return "all"


def pyvista_times(name):
    import pyvista

    reader = pyvista.get_reader(str(run / name))
    need(np.allclose(reader.time_values, times, rtol=1e-12, atol=0), f"{name}: its times")
    reader.set_active_time_value(reader.time_values[-1])
    mesh = reader.read()
    mesh = mesh[0] if isinstance(mesh, pyvista.MultiBlock) else mesh
    same_particles(mesh.points, mesh["stress"], 1e-12)
    return "all, with times"


def pyvista_xdmf(name):
    mesh = pyvista_read(name)
    mesh = mesh.combine() if hasattr(mesh, "combine") else mesh
    need(mesh.n_points > 0, f"{name}: no points")
    return "all, with times"


# ---- VTK ----


def vtk_points(reader, name):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader.SetFileName(str(run / name))
    reader.Update()
    data = reader.GetOutput()
    if data.IsA("vtkMultiBlockDataSet"):
        blocks = [data.GetBlock(b) for b in range(data.GetNumberOfBlocks())]
        return np.concatenate([vtk_to_numpy(block.GetPoints().GetData()) for block in blocks]), blocks
    return vtk_to_numpy(data.GetPoints().GetData()), [data]


def vtk_snapshot():
    import vtk

    points, _ = vtk_points(vtk.vtkHDFReader(), snapshots[-1].name)
    same_particles(points, tolerance=1e-12)
    return "all"


def vtk_tecplot():
    import vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points, blocks = vtk_points(quiet(vtk.vtkTecplotReader()), snapshots[-1].with_suffix(".dat").name)
    same_particles(points)
    ids = 0
    for bits, name in ((48, "id_high [-]"), (24, "id_middle [-]"), (0, "id_low [-]")):
        column = np.concatenate([vtk_to_numpy(block.GetPointData().GetArray(name)) for block in blocks])
        ids = ids + (column.astype(np.int64) << bits)
    need(np.array_equal(ids, last.ids), "the ids of three columns are others")
    return "all, in single precision"


def vtk_outline():
    import vtk

    points, _ = vtk_points(quiet(vtk.vtkTecplotReader()), outline.name)
    table = np.stack([History(outline)[name] for name in "XYZ"], axis=1)
    need(points.shape == table.shape and np.allclose(points, table, rtol=1e-6), "the outline is another")
    return "points"


def quiet(reader):
    import vtk

    vtk.vtkObject.GlobalWarningDisplayOff()
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)
    return reader


# ---- meshio, numpy, h5py, f90nml, tools of nanoindentation ----


def meshio_series():
    import meshio

    with meshio.xdmf.TimeSeriesReader(run / "particles.xdmf") as reader:
        points, cells = reader.read_points_cells()
        time, data, _ = reader.read_data(reader.num_steps - 1)
    need(len(points) == len(Particles(snapshots[0]).ids) and time == times[-1], "meshio: points or time")
    same_particles(last["position"], data["stress"], 1e-12)
    return "all, by `TimeSeriesReader`"


def h5py_snapshot():
    with h5py.File(snapshots[-1]) as file:
        same_particles(file["VTKHDF/Points"][:], file["VTKHDF/PointData/stress"][:], 1e-12)
    return "all"


def numpy_history():
    for name in ("tool_cone.dat", "energy.dat", "probe_under.dat"):
        head = ["TITLE", "VARIABLES", "ZONE", "AUXDATA"]
        table = np.loadtxt(run / name, comments=head, ndmin=2)
        rows = int(re.search(r", I=(\d+) *,", (run / name).read_text())[1])
        need(len(table) == rows > 1, f"{name}: I={rows} for {len(table)} rows")
        need(np.array_equal(table[:, 0], History(str(run / name))["time"]), f"{name}: its times")
    return "rows; `I=` is their number"


def f90nml_case():
    import f90nml

    case = f90nml.read(run / "case.nml")
    need(math.isclose(case["level"]["lower"][2], 4e-6), "f90nml: a value")
    return "every value"


angle, load = math.radians(70.3), 2e-3


def curve():
    """An exact Oliver-Pharr curve as hardness.hld: stiffness (N/m), hardness (Pa)."""
    deepest, final, exponent = 200e-9, 175e-9, 1.4
    factor = load / (deepest - final) ** exponent
    down, up = np.linspace(0, deepest, 400), np.linspace(deepest, final, 200)[1:]
    loads = [load * (down / deepest) ** 2, factor * (up - final) ** exponent]
    tool = {"shape": ["cone"], "half_angle": [70.3]}
    text = hld_text(
        np.linspace(0, 2e-8, 599), np.concatenate([down, up]), np.concatenate(loads), tool, "a curve"
    )
    (run / "hardness.hld").write_text(text)
    stiffness = factor * exponent * (deepest - final) ** (exponent - 1)
    area = math.pi * ((deepest - 0.75 * load / stiffness) * math.tan(angle)) ** 2
    return stiffness, load / area


def within(tool, stiffness, hardness, exact):
    for what, value, right in (("stiffness", stiffness, exact[0]), ("hardness", hardness, exact[1])):
        need(abs(value / right - 1) < 0.01, f"{tool}: {what} {value:.4g} for {right:.4g}")
    return "S and H within 1 %"


def by_nanodent():
    import nanodent
    from nanodent.analysis.oliver_pharr import analyze_oliver_pharr

    exact = curve()
    experiment = nanodent.load_experiment(run / "hardness.hld")
    depth, force = (experiment.test.columns[name] for name in ("disp_nm", "force_uN"))
    top = int(np.argmax(force))
    found = analyze_oliver_pharr(
        depth[top:],
        force[top:],
        onset_disp_nm=0.0,
        baseline_offset_uN=0.0,
        tip_area_function=experiment.parsed_tip_area_function,
    )
    return within("nanodent", 1e3 * found.stiffness_uN_per_nm, 1e12 * found.hardness_uN_per_nm2, exact)


def by_micromechanics():
    from micromechanics.indentation import Indentation

    exact = curve()
    test = Indentation(str(run / "hardness.hld"))
    test.analyse()
    return within("micromechanics", 1e3 * test.slope[0], 1e9 * test.hardness[0], exact)


# ---- ParaView ----

PARAVIEW = """
import sys
from paraview import simple
for name in sys.argv[1:]:
    reader = simple.OpenDataFile(name)
    times = getattr(reader, 'TimestepValues', [0.0])
    times = list(times or [0.0]) if hasattr(times, '__len__') else [times]
    simple.UpdatePipeline(proxy=reader, time=times[-1])
    print('FOUND', name, reader.GetDataInformation().GetNumberOfPoints(), len(times))
"""


@lru_cache
def in_paraview():
    """Points at the last time, and times, of all files that ParaView opens, by their names."""
    (run / "open_all.py").write_text(PARAVIEW)
    names = [snapshots[-1].name, "particles.hdf.series", "particles.xdmf", "levels.xdmf", "tools.xdmf"]
    command = ["pvpython", str(run / "open_all.py"), *(str(run / name) for name in names)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100)
    found = re.findall(r"FOUND (\S+) (\d+) (\d+)", done.stdout)
    need(len(found) == len(names), f"ParaView: {done.stderr[-300:]}")
    return {Path(name).name: (int(points), int(steps)) for name, points, steps in found}


def paraview(name, points, steps, words):
    found = in_paraview()[name]
    need(found[0] == points if points else found[0] > 0, f"ParaView, {name}: {found[0]} points")
    need(found[1] == steps, f"ParaView, {name}: {found[1]} times")
    return words


count, number = len(last.ids), len(times)
FILES = {
    "`particles_<step>.hdf`": {
        "pyvista": pyvista_snapshot,
        "vtk": vtk_snapshot,
        "paraview": lambda: paraview(snapshots[-1].name, count, 1, "all"),
        "h5py": h5py_snapshot,
    },
    "`particles.hdf.series`": {
        "pyvista": lambda: pyvista_times("particles.hdf.series"),
        "paraview": lambda: paraview("particles.hdf.series", count, number, "all, with times"),
    },
    "`particles.xdmf`": {
        "pyvista": lambda: pyvista_times("particles.xdmf"),
        "paraview": lambda: paraview("particles.xdmf", count, number, "all, with times"),
        "meshio": meshio_series,
    },
    "`levels.xdmf`": {
        "pyvista": lambda: pyvista_xdmf("levels.xdmf"),
        "paraview": lambda: paraview("levels.xdmf", 0, number, "all, with times"),
    },
    "`tools.xdmf`": {
        "pyvista": lambda: pyvista_xdmf("tools.xdmf"),
        "paraview": lambda: paraview("tools.xdmf", 0, number, "all, with times"),
    },
    "`particles_<step>.dat`": {"vtk": vtk_tecplot},
    "`outline_<tool>_<step>.dat`": {"vtk": vtk_outline},
    "histories (`tool_<name>.dat`, ...)": {"numpy": numpy_history},
    "`case.nml`": {"f90nml": f90nml_case},
    "`hardness.hld`": {"micromechanics": by_micromechanics, "nanodent": by_nanodent},
}
NAMES = {"pyvista": "PyVista", "vtk": "VTK", "paraview": "ParaView", "numpy": "NumPy"}


def version(tool):
    """The version of a tool that is installed; nothing if it is not."""
    if tool == "paraview":
        if not shutil.which("pvpython"):
            return None
        said = subprocess.run(["pvpython", "--version"], capture_output=True, text=True)
        return (said.stdout + said.stderr).split()[-1]
    try:
        return importlib.metadata.version(tool)
    except importlib.metadata.PackageNotFoundError:
        return None


table = "--table" in sys.argv
text, faults = document.read_text(), 0
versions = {tool: version(tool) for tools in FILES.values() for tool in tools}
for file, tools in FILES.items():
    for tool, opened in tools.items():
        if not versions[tool]:
            continue
        try:
            shown = opened()
        except Exception as error:
            print(f"FAILED: {file} in {tool}: {type(error).__name__}: {error}")
            faults += 1
            continue
        row = f"| {file} | {NAMES.get(tool, tool)} | {shown} |"
        if table:
            print(f"{row[:-1]}| {versions[tool]} |")
        elif row not in text:
            print(f"FAILED: {document.name} has no row {row} (readers.py --table)")
            faults += 1
absent = [tool for tool, found in versions.items() if not found]
if absent and not table:
    print(f"left out: {', '.join(absent)} (pip install 'post[readers]'; apt-get install paraview)")
sys.exit(1 if faults else 0)
