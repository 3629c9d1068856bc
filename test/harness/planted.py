#!/usr/bin/env python3
"""Planted failures for compare.py, in the current directory: each must be caught, and what is right must
pass."""

import contextlib
import io
import sys
from pathlib import Path

import h5py
import numpy as np

import compare

caught = 0


def outcome(arguments):
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        status = compare.main(arguments.split())
    return status, output.getvalue()


def must_pass(what, arguments):
    status, output = outcome(arguments)
    if status != 0:
        sys.exit(f"FAILED: {what} does not pass: {output}")


def must_fail(what, text, arguments):
    global caught
    status, output = outcome(arguments)
    if status == 0:
        sys.exit(f"FAILED: not noticed: {what}")
    if text not in output:
        sys.exit(f"FAILED: {what}: nothing says '{text}': {output}")
    caught += 1


def history(path, rows, columns='"time [s]" "load_z [N]" "zero [J]"'):
    Path(path).parent.mkdir(exist_ok=True)
    text = f'TITLE = "x"\nVARIABLES = {columns}\nZONE T="x", STRANDID=1, SOLUTIONTIME=1.0\n'
    Path(path).write_text(text + "".join(" ".join(f"{v:.17g}" for v in row) + "\n" for row in rows))


rows = np.array([[0, 0, 0], [1, 50, 0], [2, 100, 0]], dtype=float)


def changed(row, column, value):
    other = rows.copy()
    other[row, column] = value
    return other


history("good.dat", rows)
history("near.dat", changed(1, 1, 50 + 9e-7))
history("wrong.dat", changed(1, 1, 50 + 2e-6))
history("nan.dat", changed(1, 1, np.nan))
history("infinite.dat", changed(1, 1, np.inf))
history("not_zero.dat", changed(1, 2, 1e-30))
Path("block.dat").write_text(
    Path("good.dat").read_text().split("ZONE")[0]
    + 'ZONE T="x", I=3, J=1, K=1, DATAPACKING=BLOCK\n0 1\n2\n0 50 100\n0 0 0\n'
)
Path("block_short.dat").write_text(Path("block.dat").read_text().replace("0 50 100", "0 50"))
history("short.dat", rows[:2])
history("empty.dat", rows[:0])
history("extra.dat", np.c_[rows, rows[:, 0]], '"time [s]" "load_z [N]" "zero [J]" "more"')
history("fewer.dat", rows[:, :2], '"time [s]" "load_z [N]"')
history("renamed.dat", rows, '"time [s]" "load_x [N]" "zero [J]"')
Path("ragged.dat").write_text(Path("good.dat").read_text() + "3 4\n")
Path("text.dat").write_text(Path("good.dat").read_text() + "3 ***** 0\n")
for name in ("a", "b", "c", "d"):
    history(f"{name}/x.dat", rows)
history("a/y.dat", rows)
history("b/y.dat", rows)
history("d/y.dat", rows)
history("d/z.dat", rows)


def particles(path, order=(0, 1, 2, 3), time=1.0, drop=(), add=(), **changes):
    order = list(order)
    ids = np.array([7, 3, 12, 5])
    fields = {"id": ids, "mass": np.array([1.0, 2, 3, 4]), "stress": np.arange(24.0).reshape(4, 6)}
    points = np.arange(12.0).reshape(4, 3)
    for name, (index, value) in changes.items():
        (points if name == "position" else fields[name])[index] = value
    with h5py.File(path, "w") as file:
        file.attrs["time"] = time
        group = file.create_group("VTKHDF")
        group["Points"] = points[order]
        for name, data in fields.items():
            if name not in drop:
                group[f"PointData/{name}"] = data[order]
        for name in add:
            group[f"PointData/{name}"] = np.zeros(len(order))


particles("good.h5")
particles("shuffled.h5", order=(2, 0, 3, 1))
particles("wrong.h5", stress=((1, 2), 8.001))
particles("nan.h5", order=(2, 0, 3, 1), mass=(0, np.nan))
particles("moved.h5", position=((0, 0), 0.1))
particles("fewer.h5", order=(0, 1, 2))
particles("other.h5", id=(0, 8))
particles("twice.h5", id=(0, 3))
particles("dropped.h5", drop=("mass",))
particles("added.h5", add=("more",))
particles("later.h5", time=1.1)
Path("broken.h5").write_bytes(Path("good.h5").read_bytes()[:200])
must_pass("equal histories", "good.dat good.dat")
must_pass("a value within its tolerance", "--tolerance 1e-8 good.dat near.dat")
must_pass("a column with a tolerance of its own", "--tolerance 1e-12 --column load_z=1e-7 good.dat wrong.dat")
must_pass("an ignored column", "--ignore more good.dat extra.dat")
must_pass("a scale of its own", "--scale zero=1 good.dat not_zero.dat")
must_pass("equal particles in another order", "good.h5 shuffled.h5")
must_pass("block packing", "good.dat block.dat")
must_pass("equal directories", "a b")

must_fail("a wrong value", "load_z is 50.000002", "--tolerance 1e-8 good.dat wrong.dat")
must_fail("a NaN", "not finite", "--tolerance 1e9 good.dat nan.dat")
must_fail("a tolerance that is no number", "load_z", "--tolerance nan good.dat good.dat")
must_fail("a NaN on both sides", "not finite", "nan.dat nan.dat")
must_fail("an infinity", "not finite", "--tolerance 1e9 good.dat infinite.dat")
must_fail("something where the reference is 0", "its scale is 0", "--tolerance 1 good.dat not_zero.dat")
must_fail("a missing row", "2 rows", "good.dat short.dat")
must_fail("an extra row", "3 rows", "short.dat good.dat")
must_fail("no rows at all", "no rows", "empty.dat empty.dat")
must_fail("an extra column", "more is not in the reference", "good.dat extra.dat")
must_fail("a missing column", "zero is missing", "good.dat fewer.dat")
must_fail("a renamed column", "load_z is missing", "good.dat renamed.dat")
must_fail("a short row", "2 values for 3 columns", "good.dat ragged.dat")
must_fail("a short block", "8 values", "good.dat block_short.dat")
must_fail("stars in a row", "not a row of numbers", "good.dat text.dat")
must_fail("a missing file", "no such file", "good.dat absent.dat")
must_fail("a missing reference", "no such file", "absent.dat good.dat")
must_fail("a missing file in a directory", "y.dat: no such file", "a c")
must_fail("an extra file in a directory", "z.dat: no such file", "a d")
must_fail("a missing directory", "no such directory", "a absent")
must_fail("a wrong component", "particle 3; off by", "--tolerance 1e-5 good.h5 wrong.h5")
must_fail("a NaN of a particle", "mass is not finite (particle 7)", "--tolerance 1e9 good.h5 nan.h5")
must_fail("a moved particle", "position", "--tolerance 1e-3 good.h5 moved.h5")
must_fail("a missing particle", "1 particles missing", "good.h5 fewer.h5")
must_fail("an extra particle", "1 extra", "fewer.h5 good.h5")
must_fail("another id", "1 particles missing, 1 extra", "good.h5 other.h5")
must_fail("an id twice", "twice", "good.h5 twice.h5")
must_fail("a missing field", "mass is missing", "good.h5 dropped.h5")
must_fail("an extra field", "more is not", "good.h5 added.h5")
must_fail("another time", "time is 1.1", "good.h5 later.h5")
must_fail("a broken file", "broken.h5", "good.h5 broken.h5")

print(f"compare.py: {caught} planted failures caught")
