"""Read with other programs' readers what the tests of output wrote: numpy, h5py, and ParaView's own readers
(vtk).

read_back.py DIRECTORY...   directories written on 1, 2, 4 ranks; the first one is read, the others must equal
it"""

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

import h5py
import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from made_up import STEPS, in_file_order, levels, names_of, particles, time_of, unit_of
from gimp3d.run_data import Particles

TECPLOT = ["X(m)", "Y(m)", "Z(m)", "id [-]", "id_high [-]", "id_middle [-]", "id_low [-]"] + [
    f"{part} [{unit_of(name) or '-'}]" for name in particles(0)[3] for part in names_of(name)
]


class Wrong(Exception):
    pass


FOUND = (Wrong, OSError, LookupError, ValueError)  # what says that a file is not as it should be


def need(condition, sentence):
    if not condition:
        raise Wrong(sentence)


def need_equal(values, expected, what, tolerance=0.0):
    values, expected = numpy.asarray(values), numpy.asarray(expected)
    need(values.shape == expected.shape, f"{what}: shape {values.shape}, expected {expected.shape}")
    good = numpy.abs(values - expected) <= tolerance * numpy.abs(expected)
    need(bool(numpy.all(good)), f"{what}: {numpy.count_nonzero(~good)} of {good.size} values differ")


# ---- readers
# ------------------------------------------------------------------------------------------------------------


class Complaints:
    """VTK reports errors to an observer instead of returning them."""

    def __init__(self, reader):
        self.text = []
        self.CallDataType = "string0"
        reader.AddObserver("ErrorEvent", self.hear)
        if reader.GetExecutive() is not None:
            reader.GetExecutive().AddObserver("ErrorEvent", self.hear)

    def hear(self, *arguments):
        self.text.append(str(arguments[-1]))


def vtk_grids(data, what):
    """The grids in what a reader gave."""
    need(data is not None, f"{what}: the reader gives nothing")
    if isinstance(data, vtk.vtkPointSet):
        return [data]
    iterator = data.NewIterator()
    iterator.InitTraversal()
    leaves = []
    while not iterator.IsDoneWithTraversal():
        leaves.append(iterator.GetCurrentDataObject())
        iterator.GoToNextItem()
    return leaves


def vtk_grid(data, what):
    """The one grid in what a reader gave."""
    grids = vtk_grids(data, what)
    need(len(grids) == 1, f"{what}: {len(grids)} grids, expected one")
    return grids[0]


def array(grid, name, what):
    values = grid.GetPointData().GetArray(name)
    need(values is not None, f"{what}: no array {name}")
    return vtk_to_numpy(values)


def check_grid(grid, step, what):
    """Points, ids and fields of a grid, by id: the columns as in the file."""
    count, position, ids, fields = particles(step)
    need(grid.GetNumberOfPoints() == count, f"{what}: {grid.GetNumberOfPoints()} points, expected {count}")
    need(grid.GetNumberOfCells() == count, f"{what}: {grid.GetNumberOfCells()} cells, expected {count}")
    found = array(grid, "id", what)
    need(found.dtype == numpy.int64, f"{what}: ids are {found.dtype}")
    order = numpy.argsort(found)
    need_equal(found[order], ids, f"{what}: id")
    need_equal(vtk_to_numpy(grid.GetPoints().GetData())[order], position, f"{what}: position", 1e-15)
    for name, values in fields.items():
        values = in_file_order(name, values)
        got = array(grid, name, what)[order].reshape(count, -1)
        need_equal(got, values, f"{what}: {name}", 1e-13)
        need_equal([got.min(), got.max()], [values.min(), values.max()], f"{what}: range of {name}", 1e-14)


def check_hdf5(path, step):
    """What stands in the file, without VTK."""
    count, position, ids, fields = particles(step)
    with h5py.File(path, "r") as file:
        need(file.attrs["time"] == time_of(step), f"{path}: time")
        need(file.attrs["time_unit"] == b"s" and file.attrs["step"] == step, f"{path}: step or unit of time")
        need(file.attrs["title"] == b'made-up <particles> & "quotes"', f"{path}: title")
        top = file["VTKHDF"]
        need(
            list(top.attrs["Version"]) == [1, 0] and top.attrs["Type"] == b"UnstructuredGrid",
            f"{path}: version or type",
        )
        need_equal(top["NumberOfPoints"][()], [count], f"{path}: NumberOfPoints")
        need_equal(top["Points"][()], position, f"{path}: Points", 1e-15)
        need(top["Points"].dtype == numpy.float64 and top["Types"].dtype == numpy.uint8, f"{path}: kinds")
        need_equal(top["Connectivity"][()], numpy.arange(count), f"{path}: Connectivity")
        need_equal(top["Offsets"][()], numpy.arange(count + 1), f"{path}: Offsets")
        need_equal(top["PointData/id"][()], ids, f"{path}: id")
        need(
            sorted(top["PointData"]) == sorted(["id", *fields]), f"{path}: fields {sorted(top['PointData'])}"
        )
        for name, values in fields.items():
            table = top["PointData"][name]
            need_equal(table[()].reshape(count, -1), in_file_order(name, values), f"{path}: {name}", 1e-13)
            need(table.attrs["unit"].decode() == (unit_of(name) or "1"), f"{path}: unit of {name}")
            parts = in_file_order(name, numpy.array([names_of(name)]))[0]
            need(table.attrs["components"].decode().split() == list(parts), f"{path}: components of {name}")
        need(
            top["PointData/stress"].attrs["components"]
            == b"stress_xx stress_yy stress_zz stress_xy stress_yz stress_xz",
            f"{path}: components of the stress",
        )
    whole = Particles(Path(path))
    for name, values in fields.items():
        if name == "stress_recovered":  # the plots have all tensors in one order
            values = values[:, [1, 5, 2, 3, 4, 0]]
        need_equal(whole[name].reshape(count, -1), values, f"{path}: {name} as the plots read it", 1e-13)
    with h5py.File(path, "r") as file:
        top = file["VTKHDF"]
        need_equal(top["FieldData/TimeValue"][()], [time_of(step)], f"{path}: TimeValue")


def check_vtkhdf(path, step):
    reader = vtk.vtkHDFReader()
    complaints = Complaints(reader)
    need(reader.CanReadFile(path), f"{path}: vtkHDFReader does not know it")
    reader.SetFileName(path)
    reader.Update()
    need(not complaints.text, f"{path}: {complaints.text[:1]}")
    grid = vtk_grid(reader.GetOutput(), path)
    check_grid(grid, step, path)
    time = grid.GetFieldData().GetArray("TimeValue")
    need(time is not None and time.GetValue(0) == time_of(step), f"{path}: TimeValue of the reader")


def check_tensors(path, step):
    """A filter of VTK that knows what tensors are: principal and von Mises stresses of the right ones."""
    fields = particles(step)[3]
    for name in "stress", "stress_recovered":
        reader, criteria = vtk.vtkHDFReader(), vtk.vtkYieldCriteria()
        reader.SetFileName(path)
        criteria.SetInputConnection(reader.GetOutputPort())
        criteria.UpdateInformation()
        criteria.GetPointDataArraySelection().EnableArray(name)
        criteria.GetCriteriaSelection().EnableAllArrays()
        criteria.Update()
        grid = criteria.GetOutput()
        order = numpy.argsort(array(grid, "id", path))
        principal = numpy.stack([array(grid, f"{name} - Sigma {n}", path)[order] for n in (1, 2, 3)], axis=1)
        expected = numpy.linalg.eigvalsh(
            in_file_order(name, fields[name])[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
        )
        scale = abs(expected).max(axis=1)[:, None]
        need(
            bool(numpy.all(abs(numpy.sort(principal, axis=1) - expected) < 1e-10 * scale)),
            f"{path}: principal values of {name}",
        )
        need_equal(
            array(grid, f"{name} - Von Mises Criterion", path)[order],
            fields[name.replace("stress", "von_mises")].reshape(-1),
            f"{path}: von Mises stress of {name}",
            1e-12,
        )


def times_in(reader, path):
    """The times of an animation that a reader has been given."""
    need(os.path.isfile(path), f"{path}: not there")
    reader.SetFileName(path)
    reader.UpdateInformation()
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    information = reader.GetOutputInformation(0)
    need(information.Has(key), f"{path}: no times")
    return information.Get(key)


def check_xdmf(path):
    """An animation with the right times, each frame read."""
    reader = vtk.vtkXdmfReader()
    complaints = Complaints(reader)
    need_equal(times_in(reader, path), [time_of(s) for s in STEPS], f"{path}: times", 1e-15)
    for step in STEPS:
        reader.UpdateTimeStep(time_of(step))
        check_grid(vtk_grid(reader.GetOutputDataObject(0), path), step, f"{path} at step {step}")
    need(not complaints.text, f"{path}: {complaints.text[:1]}")
    with open(path, encoding="ascii") as file:
        need(
            "HyperSlab" not in file.read(),
            f"{path}: a column of a table, which ParaView's newer reader (vtkXdmf3Reader) leaves out",
        )


def check_series(path):
    """The snapshots with their times, as ParaView's readers of series take them (by_paraview.py lets it)."""
    with open(path, encoding="ascii") as file:
        series = json.load(file)
    need(
        list(series) == ["file-series-version", "files"] and series["file-series-version"] == "1.0",
        f"{path}: {list(series)}",
    )
    files = [{"name": f"particles_{step:08d}.hdf", "time": time_of(step)} for step in STEPS]
    need(series["files"] == files, f"{path}: {series['files']}")


def check_outlines(path):
    """The twelve edges of the box of each level, moving in time."""
    reader = vtk.vtkXdmfReader()
    complaints = Complaints(reader)
    need_equal(times_in(reader, path), [time_of(s) for s in STEPS], f"{path}: times", 1e-15)
    for step in STEPS:
        reader.UpdateTimeStep(time_of(step))
        what = f"{path} at step {step}"
        grids = vtk_grids(reader.GetOutputDataObject(0), what)
        need(len(grids) == 3, f"{what}: {len(grids)} boxes, expected 3")
        for grid, (number, lower, upper, cell, _) in zip(grids, levels(step)):
            need_equal(
                grid.GetBounds(), numpy.stack([lower, upper], axis=1).ravel(), f"{what}: box {number}", 1e-15
            )
            need_equal(vtk_to_numpy(grid.GetCellData().GetArray("level")), [number] * 12, f"{what}: level")
            need_equal(
                vtk_to_numpy(grid.GetCellData().GetArray("cell_size")),
                [cell] * 12,
                f"{what}: cell_size",
                1e-15,
            )
            lengths = []
            for n in range(12):
                ends = [numpy.array(grid.GetPoint(grid.GetCell(n).GetPointId(i))) for i in (0, 1)]
                way = ends[1] - ends[0]
                need(
                    grid.GetCell(n).GetNumberOfPoints() == 2 and numpy.count_nonzero(way) == 1,
                    f"{what}: edge {n}",
                )
                lengths.append((numpy.argmax(abs(way)), *numpy.minimum(*ends)))
            need(len(set(lengths)) == 12, f"{what}: an edge stands twice")
    need(not complaints.text, f"{path}: {complaints.text[:1]}")


def check_boxes(path, step):
    """The boxes of the levels as field data: by h5py and by VTK."""
    expected = [numpy.array(values) for values in zip(*levels(step))][1:4]
    reader = vtk.vtkHDFReader()
    reader.SetFileName(path)
    reader.Update()
    shown = vtk_grid(reader.GetOutput(), path).GetFieldData()
    with h5py.File(path, "r") as file:
        for name, values in zip(("level_lower", "level_upper", "level_cell"), expected):
            table = file[f"VTKHDF/FieldData/{name}"]
            need_equal(table[()], values, f"{path}: {name}", 1e-15)
            need(table.attrs["unit"] == b"m", f"{path}: unit of {name}")
            need(shown.GetArray(name) is not None, f"{path}: the reader knows no {name}")
            need_equal(vtk_to_numpy(shown.GetArray(name)), values, f"{path}: {name} by VTK", 1e-15)


def check_tecplot(path, step, zones=None):
    """Header and every value by numpy; then what VTK's reader makes of it. `zones`: number and particles of
    each, else one."""
    count, position, ids, fields = particles(step)
    bits = numpy.stack([ids >> 48, ids >> 24 & 2**24 - 1, ids & 2**24 - 1], axis=1)
    table = numpy.hstack([position, bits, *fields.values()])
    with open(path, encoding="ascii") as file:
        title, variables = (file.readline().rstrip("\n") for _ in range(2))
        body = file.read()
    need(title.startswith('TITLE="') and f"step {step}, time " in title, f"{path}: {title}")
    need(variables == "VARIABLES=" + ", ".join(f'"{name}"' for name in TECPLOT), f"{path}: {variables}")
    need(body.endswith("\n"), f"{path}: the last line is torn")
    lines = body.split("\n")[:-1]
    first = 0
    parts = []
    for number, length in zones or [(0, count)]:
        zone, lines = lines[0], lines[1:]
        need(
            zone.startswith(f'ZONE T="level {number}", STRANDID={number or 1}, SOLUTIONTIME='),
            f"{path}: {zone}",
        )
        need(zone.endswith("DATAPACKING=BLOCK"), f"{path}: {zone}")
        record = dict(part.strip().split("=") for part in zone[5:].split(","))
        need(float(record["SOLUTIONTIME"]) == time_of(step) and record["J"] == str(length), f"{path}: {zone}")
        need(
            len(lines) >= length * len(TECPLOT),
            f"{path}: {len(lines)} values, expected {length * len(TECPLOT)} and more",
        )
        blocks = [lines[n * length : (n + 1) * length] for n in range(len(TECPLOT))]
        lines = lines[length * len(TECPLOT) :]
        part = slice(first, first + length)
        parts.append(part)
        first += length
        need_equal([int(v) for v in blocks[3]], ids[part], f"{path}: id")
        values = numpy.array([[float(v) for v in block] for n, block in enumerate(blocks) if n != 3]).T
        need_equal(values, table[part], f"{path}: values", 1e-13)
    need(not lines, f"{path}: {len(lines)} lines more than expected")

    reader = vtk.vtkTecplotReader()
    complaints = Complaints(reader)
    reader.SetFileName(path)
    reader.Update()
    need(not complaints.text, f"{path}: {complaints.text[:1]}")
    grids = vtk_grids(reader.GetOutput(), path)
    need(len(grids) == len(parts), f"{path}: {len(grids)} grids, expected {len(parts)}")
    for grid, part in zip(grids, parts):
        expected = position[part]
        need(
            grid.GetNumberOfPoints() == len(expected),
            f"{path}: {grid.GetNumberOfPoints()} points, expected {len(expected)}",
        )
        # floats
        need_equal(vtk_to_numpy(grid.GetPoints().GetData()), expected, f"{path}: position by VTK", 1e-6)
        need_equal(
            array(grid, "stress_zz [Pa]", path), fields["stress"][part, 2], f"{path}: stress_zz by VTK", 1e-6
        )


def check_tecplot_levels(path, step):
    check_tecplot(path, step, [(number, count) for number, _, _, _, count in levels(step) if count > 0])


def check_empty(directory):
    """No particles: an empty grid, and a header without a zone."""
    path = f"{directory}/particles_00000007.hdf"
    reader = vtk.vtkHDFReader()
    complaints = Complaints(reader)
    reader.SetFileName(path)
    reader.Update()
    need(not complaints.text, f"{path}: {complaints.text[:1]}")
    need(reader.GetOutput().GetNumberOfPoints() == 0, f"{path}: has points")
    with h5py.File(path, "r") as file:
        need(
            file["VTKHDF/Points"].shape == (0, 3) and file["VTKHDF/PointData/stress"].shape == (0, 6),
            f"{path}: shapes",
        )
    with open(f"{directory}/particles_00000007.dat", encoding="ascii") as file:
        lines = file.read().splitlines()
    need(
        len(lines) == 2 and float(lines[0].split(", time ")[1].split()[0]) == time_of(7),
        f"{directory}: {lines[:1]}",
    )


def history(path):
    """Header lines and rows, as the plots read them."""
    with open(path, encoding="ascii") as file:
        lines = file.read().split("\n")
    need(lines[-1] == "", f"{path}: the last line is torn")
    header = [line for line in lines if line[:1].isalpha()]
    need(lines[: len(header)] == header, f"{path}: header lines below the rows")
    rows = numpy.loadtxt(path, skiprows=len(header), ndmin=2)
    need(
        header[0].startswith('TITLE="')
        and header[1].startswith('VARIABLES="')
        and header[2].startswith('ZONE T="'),
        f"{path}: {header[:3]}",
    )
    need("SOLUTIONTIME=" in header[2] and "STRANDID=" in header[2], f"{path}: {header[2]}")
    need(len(header[1].split(", ")) == rows.shape[1], f"{path}: {rows.shape[1]} columns")
    return header, rows


def check_curve(path):
    header, rows = history(path)
    n = numpy.arange(101)
    need_equal(rows, numpy.stack([n * 1.1e-12, -n / 3.0, 1e-300 * n], axis=1), path, 1e-15)
    need('AUXDATA symmetry="quarter model"' in header, f"{path}: {header}")
    need(header[1] == 'VARIABLES="time [s]", "depth [m]", "load_x [N]"', f"{path}: {header[1]}")


def check_nan(path):
    _, rows = history(path)
    need(bool(numpy.isnan(rows[0, 1])) and rows[0, 2] == -numpy.finfo(float).max, f"{path}: {rows}")
    need(rows[1, 2] == -numpy.finfo(float).tiny, f"{path}: {rows}")


def check_cost(path, ranks):
    header, rows = history(path)
    names = [line.split('"')[1] for line in header if line.startswith("AUXDATA phase_")]
    need(rows.shape == (len(names), 7) and names[-1] == "all", f"{path}: {rows.shape}, {names}")
    stress = rows[names.index("stress")]
    mean = (ranks + 1) / 2
    need_equal(stress[1:], [1, mean, ranks, 10, mean * ranks, 10 * mean], f"{path}: stress", 1e-14)
    need_equal(rows[:-1, 2].sum(), rows[-1, 2], f"{path}: sum of means", 1e-14)
    need_equal(rows[:-1, 6].sum(), 100.0, f"{path}: sum of shares", 1e-14)


# ---- ranks
# ------------------------------------------------------------------------------------------------------------


def tables(path):
    found = {}
    with h5py.File(path, "r") as file:

        def visit(name, item):
            if isinstance(item, h5py.Dataset):
                found[name] = item[()]
            for key, value in item.attrs.items():
                found[f"{name}@{key}"] = value

        visit("/", file)
        file.visititems(visit)
    return found


def check_same(path, other):
    """The same bytes; for HDF5 the same tables and attributes, bit by bit."""
    if path.endswith(".hdf"):
        one, two = tables(path), tables(other)
        need(list(one) == list(two), f"{other}: other tables")
        for name, value in one.items():
            a, b = numpy.asarray(value), numpy.asarray(two[name])
            need(
                a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes(),
                f"{other}: {name} differs",
            )
        return
    with open(path, "rb") as first, open(other, "rb") as second:
        need(first.read() == second.read(), f"{other} differs from {path}")


def check_nothing_left(directory):
    left = [name for _, _, names in os.walk(directory) for name in names if name.endswith((".part", ".old"))]
    need(not left, f"{directory}: left over: {left}")


# ---- planted failures
# ------------------------------------------------------------------------------------------------------------


def damage(kind, path):
    """Make a file wrong in one way."""
    if kind == "truncated":
        os.truncate(path, os.path.getsize(path) * 2 // 3)
    elif kind == "missing":
        os.remove(path)
    elif kind == "torn":
        os.truncate(path, os.path.getsize(path) - 5)
    elif kind == "wrong id":
        with h5py.File(path, "r+") as file:
            file["VTKHDF/PointData/id"][17] += 1
    elif kind == "nan":
        with h5py.File(path, "r+") as file:
            file["VTKHDF/PointData/stress"][3, 2] = numpy.nan
    elif kind == "other order":
        with h5py.File(path, "r+") as file:
            table = file["VTKHDF/PointData/stress"]
            table[:] = table[:][:, [0, 1, 2, 5, 4, 3]]
    elif kind == "other box":
        with h5py.File(path, "r+") as file:
            file["VTKHDF/FieldData/level_upper"][1, 2] += 1.0
    elif kind == "swapped":
        with h5py.File(path, "r+") as file:
            table = file["VTKHDF/PointData/density"]
            table[4], table[5] = table[5], table[4]
    else:
        old, new = kind
        with open(path, encoding="ascii") as file:
            text = file.read()
        assert old in text, (kind, path)
        with open(path, "w", encoding="ascii") as file:
            file.write(text.replace(old, new, 1))


def plants(top):
    """Name, file, damage, and the check that must find it."""
    h5, dat, xdmf = "run/particles_00000010.hdf", "run/particles_00000010.dat", "run/particles.xdmf"
    for kind in ("truncated", "missing", "wrong id", "nan", "swapped"):
        yield f"{kind} h5, h5py", h5, kind, lambda d: check_hdf5(f"{d}/{h5}", 10)
    for kind in ("truncated", "wrong id", "nan", "swapped", "other order"):
        yield f"{kind} h5, VTK", h5, kind, lambda d: check_vtkhdf(f"{d}/{h5}", 10)
        yield f"{kind} h5, XDMF", h5, kind, lambda d: check_xdmf(f"{d}/{xdmf}")
        if kind == "other order":
            yield f"{kind}, tensors", h5, kind, lambda d: check_tensors(f"{d}/{h5}", 10)
        yield f"{kind} h5, other ranks", h5, kind, lambda d: check_same(f"{top}/{h5}", f"{d}/{h5}")
    for kind in (
        "truncated",
        "torn",
        "missing",
        ("J=", "J=1"),
        ("E-001", "E-002"),
        ("BLOCK", "POINT"),
        ("E-001", " NaN "),
    ):
        yield f"{kind} Tecplot", dat, kind, lambda d: check_tecplot(f"{d}/{dat}", 10)
    yield "wrong time in the index", xdmf, ('Value="1.2', 'Value="1.3'), lambda d: check_xdmf(f"{d}/{xdmf}")
    yield (
        "index of a missing step",
        xdmf,
        ("20.hdf:/VTKHDF/PointData/density", "10.hdf:/VTKHDF/PointData/density"),
        lambda d: check_xdmf(f"{d}/{xdmf}"),
    )
    series = "run/particles.hdf.series"
    for kind in ("truncated", "missing", ("time\": 1.2", "time\": 1.3"), ("00000030", "00000025")):
        yield f"{kind} series", series, kind, lambda d: check_series(f"{d}/{series}")
    boxes, zones, outlines = (
        "levels/particles_00000010.hdf",
        "levels/particles_00000010.dat",
        "levels/levels.xdmf",
    )
    for kind in ("missing", "other box"):
        yield f"{kind} h5, boxes", boxes, kind, lambda d: check_boxes(f"{d}/{boxes}", 10)
    for kind in (
        "truncated",
        "torn",
        ('T="level 3"', 'T="level 2"'),
        ("STRANDID=3", "STRANDID=1"),
        ("J=", "J=1"),
        ("E-001", "E-002"),
    ):
        yield f"{kind} Tecplot, levels", zones, kind, lambda d: check_tecplot_levels(f"{d}/{zones}", 10)
    for kind in (
        "truncated",
        "missing",
        ("\n2 3\n", "\n0 1\n"),
        ("\n3\n3\n", "\n2\n3\n"),
        ("\n20.", "\n20.1"),
        ('Value="1.2', 'Value="1.3'),
    ):
        yield f"{kind} outlines", outlines, kind, lambda d: check_outlines(f"{d}/{outlines}")
    for kind in ("truncated", "torn", "missing", ("E-001", "E-002"), ("quarter", "half")):
        yield f"{kind} curve", "curve.dat", kind, lambda d: check_curve(f"{d}/curve.dat")
    yield "nan gone", "nan.dat", ("NaN", "0.0"), lambda d: check_nan(f"{d}/nan.dat")


def outcome(check, copy):
    """Status of a check in a process of its own: 0 nothing found, 1 found, 2 another fault, negative: the
    reader crashed."""
    child = os.fork()
    if child == 0:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # the readers' own complaints
        try:
            check(copy)
            status = 0
        except FOUND:
            status = 1
        except BaseException as fault:  # a fault of this file
            print(f"{type(fault).__name__}: {fault}", flush=True)
            status = 2
        os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def check_plant(top, name, path, kind, check):
    with tempfile.TemporaryDirectory() as parent:
        copy = shutil.copytree(top, f"{parent}/copy")
        need(outcome(check, copy) == 0, f"the undamaged copy does not pass: {name}")
        damage(kind, f"{copy}/{path}")
        status = outcome(check, copy)
        need(status == 1 or status < 0, f"planted failure was not found: {name} ({status})")


# ---- all
# ------------------------------------------------------------------------------------------------------------


def checks(directories):
    top = directories[0]
    for step in STEPS:
        path = f"{top}/run/particles_{step:08d}"
        yield f"h5py, step {step}", lambda path=path, step=step: check_hdf5(path + ".hdf", step)
        yield f"vtkHDFReader, step {step}", lambda path=path, step=step: check_vtkhdf(path + ".hdf", step)
        yield f"tensors, step {step}", lambda path=path, step=step: check_tensors(path + ".hdf", step)
        yield f"Tecplot, step {step}", lambda path=path, step=step: check_tecplot(path + ".dat", step)
        path = f"{top}/levels/particles_{step:08d}"
        yield f"h5py, levels, step {step}", lambda path=path, step=step: check_hdf5(path + ".hdf", step)
        yield (
            f"vtkHDFReader, levels, step {step}",
            lambda path=path, step=step: check_vtkhdf(path + ".hdf", step),
        )
        yield f"boxes, step {step}", lambda path=path, step=step: check_boxes(path + ".hdf", step)
        yield (
            f"Tecplot, a zone a level, step {step}",
            lambda path=path, step=step: check_tecplot_levels(path + ".dat", step),
        )
    for run in ("run", "levels"):
        yield f"XDMF animation, {run}", lambda run=run: check_xdmf(f"{top}/{run}/particles.xdmf")
        yield f"series, {run}", lambda run=run: check_series(f"{top}/{run}/particles.hdf.series")
    yield "XDMF animation of the levels", lambda: check_outlines(f"{top}/levels/levels.xdmf")
    for name, what in (
        ("run/levels.xdmf", "an index of levels without levels"),
        ("levels/levels.hdf.series", "a series of levels"),
    ):
        yield name, lambda name=name, what=what: need(not os.path.exists(f"{top}/{name}"), what)
    yield "no particles", lambda: check_empty(f"{top}/empty")
    for name in ("curve", "again"):
        yield f"history {name}", lambda name=name: check_curve(f"{top}/{name}.dat")
    yield "history with NaN", lambda: check_nan(f"{top}/nan.dat")
    for directory in directories:
        ranks = int(directory.rstrip("/").rsplit("_", 1)[1])
        yield (
            f"cost, {ranks} ranks",
            lambda directory=directory, ranks=ranks: check_cost(f"{directory}/cost.dat", ranks),
        )
        yield f"nothing left over, {ranks} ranks", lambda directory=directory: check_nothing_left(directory)
    same = [
        f"{run}/particles_{step:08d}.{kind}"
        for run in ("run", "levels")
        for step in STEPS
        for kind in ("hdf", "dat")
    ] + [
        "run/particles.xdmf",
        "run/particles.hdf.series",
        "levels/particles.xdmf",
        "levels/levels.xdmf",
        "empty/particles_00000007.hdf",
        "empty/particles_00000007.dat",
        "curve.dat",
        "again.dat",
        "nan.dat",
    ]
    for other in directories[1:]:
        for name in same:
            yield (
                f"{name} as on one rank: {other}",
                lambda other=other, name=name: check_same(f"{top}/{name}", f"{other}/{name}"),
            )
    for name, path, kind, check in plants(top):
        yield f"planted: {name}", lambda n=name, p=path, k=kind, c=check: check_plant(top, n, p, k, c)


def main():
    vtk.vtkObject.GlobalWarningDisplayOff()
    passed = failed = 0
    for name, check in checks(sys.argv[1:]):
        try:
            check()
            passed += 1
        except FOUND as wrong:
            failed += 1
            print(f"FAILED {name}: {wrong}")
    print(f"{passed} passed, {failed} failed")
    return 1 if failed or not passed else 0


if __name__ == "__main__":
    sys.exit(main())
