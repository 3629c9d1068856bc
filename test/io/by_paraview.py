"""Reads with ParaView's own readers what snapshots.f90 wrote (made_up.py says what it must be):

pvpython by_paraview.py DIRECTORY...   each as one number of ranks wrote it
"""

import os
import shutil
import sys
import tempfile
from pathlib import Path

import numpy
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy

from made_up import STEPS, SYMMETRIC, in_file_order, levels, particles, time_of

XDMF = ("Xdmf3ReaderS", "Xdmf3ReaderT", "XDMFReader")
checks = failed = 0


class Wrong(Exception):
    pass


def need(condition, sentence):
    if not condition:
        raise Wrong(sentence)


def need_near(values, expected, what, tolerance):
    values, expected = numpy.asarray(values), numpy.asarray(expected)
    need(values.shape == expected.shape, f"{what}: shape {values.shape}, expected {expected.shape}")
    need(bool(numpy.all(abs(values - expected) <= tolerance * abs(expected))), f"{what}: values differ")


def reader_of(name, path):
    """A reader by its name in ParaView, or with `open` the one that ParaView takes by itself."""
    if name == "open":
        return simple.OpenDataFile(path)
    return getattr(simple, name)(**{"FileNames" if name == "XDMFReader" else "FileName": [path]})


def grids(data):
    if not hasattr(data, "NewIterator"):
        return [data]
    iterator, leaves = data.NewIterator(), []
    while not iterator.IsDoneWithTraversal():
        leaves.append(iterator.GetCurrentDataObject())
        iterator.GoToNextItem()
    return leaves


def array(data, name, what):
    found = data.GetArray(name)
    need(found is not None, f"{what}: no array {name}")
    return vtk_to_numpy(found)


def times_of(reader, what):
    reader.UpdatePipelineInformation()
    times = list(reader.TimestepValues)
    need_near(times, [time_of(step) for step in STEPS], f"{what}: times", 1e-15)
    return times


def check_particles(reader, what):
    """Every field at every time: its name, its columns as VTK takes them, its values; nothing else."""
    for step, time in zip(STEPS, times_of(reader, what)):
        reader.UpdatePipeline(time)
        found = grids(servermanager.Fetch(reader))
        need(len(found) == 1, f"{what}: {len(found)} grids")
        grid, (count, position, ids, fields) = found[0], particles(step)
        data, at = grid.GetPointData(), f"{what}, step {step}"
        need(
            grid.GetNumberOfPoints() == count == grid.GetNumberOfCells(),
            f"{at}: {grid.GetNumberOfPoints()} points",
        )
        names = sorted(data.GetArrayName(n) for n in range(data.GetNumberOfArrays()))
        need(names == sorted(["id", *fields]), f"{at}: arrays {names}")
        order = numpy.argsort(array(data, "id", at))
        need(numpy.array_equal(array(data, "id", at)[order], ids), f"{at}: ids")
        need_near(vtk_to_numpy(grid.GetPoints().GetData())[order], position, f"{at}: position", 1e-15)
        for name, values in fields.items():
            expected = in_file_order(name, values)
            need_near(array(data, name, at)[order].reshape(count, -1), expected, f"{at}: {name}", 1e-13)
    information = reader.PointData["stress"]
    components = [information.GetComponentName(n) for n in range(information.GetNumberOfComponents())]
    need(
        components == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"],
        f"{what}: ParaView calls the components of the stress {components}",
    )


def check_tensors(reader, what):
    """The components of the tensors by the names that ParaView's Calculator knows them by."""
    step = STEPS[1]
    fields = particles(step)[3]
    for name in "stress", "stress_recovered":
        values = in_file_order(name, fields[name])
        for n, part in enumerate(SYMMETRIC):
            calculator = simple.Calculator(
                Input=reader,
                AttributeType="Point Data",
                ResultArrayName="it",
                Function=f"{name}_{part.upper()}",
            )
            calculator.UpdatePipeline(time_of(step))
            data = grids(servermanager.Fetch(calculator))[0].GetPointData()
            order = numpy.argsort(array(data, "id", what))
            need_near(
                array(data, "it", what)[order],
                values[:, n],
                f"{what}: {name}_{part.upper()} of the Calculator",
                1e-13,
            )
            simple.Delete(calculator)


def check_boxes(reader, what):
    for step, time in zip(STEPS, times_of(reader, what)):
        reader.UpdatePipeline(time)
        found, expected = grids(servermanager.Fetch(reader)), levels(step)
        need(len(found) == len(expected), f"{what}: {len(found)} boxes")
        for grid, (number, lower, upper, cell, _) in zip(found, expected):
            need_near(
                grid.GetBounds(), numpy.stack([lower, upper], axis=1).ravel(), f"{what}: box {number}", 1e-15
            )
            need_near(array(grid.GetCellData(), "level", what), [number] * 12, f"{what}: level", 0)
            need_near(array(grid.GetCellData(), "cell_size", what), [cell] * 12, f"{what}: cell_size", 1e-15)


def attempt(check, name, path):
    """Whether a file passes; says why it does not."""
    global checks
    checks += 1
    reader = None
    try:
        reader = reader_of(name, path)
        check(reader, f"{name}: {path}")
    except (Wrong, RuntimeError, AttributeError, KeyError) as wrong:
        return f"{type(wrong).__name__}: {wrong}"
    finally:
        if reader is not None:
            simple.Delete(reader)
    return None


def expect(passes, check, name, path):
    global failed
    said = attempt(check, name, path)
    if (said is None) != passes:
        failed += 1
        print(f"FAILED {name} {path}: {said or 'a planted failure was not found'}")


def plant(directory, old, new):
    """A copy of a run with another word in its index."""
    copy = Path(shutil.copytree(directory, tempfile.mkdtemp() + "/copy"))
    index = copy / "particles.xdmf"
    text = index.read_text()
    assert old in text
    index.write_text(text.replace(old, new))
    return copy


def main():
    os.chdir("/")  # names in a series are relative to the series
    directories = [Path(name) for name in sys.argv[1:]]
    for directory in directories:
        for run in "run", "levels":
            for name in *XDMF, "open":
                expect(True, check_particles, name, f"{directory}/{run}/particles.xdmf")
            for name in "VTKHDFReader", "open":
                expect(True, check_particles, name, f"{directory}/{run}/particles.hdf.series")
        for name in *XDMF, "open":
            expect(True, check_boxes, name, f"{directory}/levels/levels.xdmf")
        expect(True, check_tensors, "open", f"{directory}/run/particles.xdmf")
        expect(True, check_tensors, "open", f"{directory}/run/particles.hdf.series")
    # what has been found wanting in one reader or another
    for old, new in (
        ('AttributeType="Matrix"', 'AttributeType="Tensor6"'),
        ("PointData/von_mises<", "PointData/density<"),
    ):
        copy = plant(directories[0] / "run", old, new)
        expect(False, check_particles, "XDMFReader", f"{copy}/particles.xdmf")
        shutil.rmtree(copy.parent)
    print(f"{checks - failed} passed, {failed} failed")
    return 1 if failed else 0


sys.exit(main())
