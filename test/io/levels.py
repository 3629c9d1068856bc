"""A scene with levels, as gimp3d writes it on 1 and 2 ranks (levels.nml): the same files, which readers open.

levels.py DIRECTORY DIRECTORY LOG   the two runs, and what the first one said
"""

import re
import sys
from pathlib import Path

import h5py
import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from read_back import FOUND, array, check_same, history, need, need_equal, times_in, vtk_grids

BOXES = numpy.array(
    [[[0, 0, 0], [28, 16, 16]], [[8, 2, 2], [20, 14, 14]], [[11, 4, 4], [17, 12, 12]]], dtype=float
)
CELLS = [1.0, 0.5, 0.25]


def check_files(one, two):
    names = sorted(path.name for path in one.iterdir())
    need(names == sorted(path.name for path in two.iterdir()), f"{two}: other files than in {one}")
    need(
        {"levels.xdmf", "particles.xdmf"} <= set(names) and not any(name.endswith(".part") for name in names),
        f"{one}: {names}",
    )
    for name in names:
        if name.startswith("particles") or name in ("levels.xdmf", "probe_corner.dat"):
            check_same(f"{one}/{name}", f"{two}/{name}")


def check_zones(run):
    """A zone for each level with particles, which holds those that have its number in the HDF5 file; a strand
    of its own."""
    most = 0
    for path in sorted(run.glob("particles_*.hdf")):
        with h5py.File(path, "r") as file:
            level = file["VTKHDF/PointData/level"][()].reshape(-1)
            position, ids = file["VTKHDF/Points"][()], file["VTKHDF/PointData/id"][()]
            fields = file["VTKHDF/FieldData"]
            need_equal(fields["level_lower"][()], BOXES[:, 0], f"{path}: level_lower")
            need_equal(fields["level_upper"][()], BOXES[:, 1], f"{path}: level_upper")
            need_equal(fields["level_cell"][()], CELLS, f"{path}: level_cell")
        need(numpy.unique(ids).size == ids.size, f"{path}: an id stands twice")
        held = [n for n in (1, 2, 3) if numpy.any(level == n)]
        most = max(most, len(held))
        dat = path.with_suffix(".dat")
        zones = [line for line in dat.read_text().splitlines() if line.startswith("ZONE")]
        need(
            [re.match(r'ZONE T="level (\d)", STRANDID=(\d), SOLUTIONTIME=', zone).groups() for zone in zones]
            == [(str(n), str(n)) for n in held],
            f"{dat}: {zones}",
        )
        reader = vtk.vtkTecplotReader()
        reader.SetFileName(str(dat))
        reader.Update()
        for n, grid in zip(held, vtk_grids(reader.GetOutput(), str(dat))):
            need_equal(
                vtk_to_numpy(grid.GetPoints().GetData()), position[level == n], f"{dat}: level {n}", 1e-6
            )
            need(
                bool(numpy.all(array(grid, "level [-]", str(dat)) == n)),
                f"{dat}: a particle of another level in zone {n}",
            )
    need(most == 3, f"{run}: no snapshot has particles on all levels")


def check_outlines(run):
    reader = vtk.vtkXdmfReader()
    times = times_in(reader, f"{run}/levels.xdmf")
    need(len(times) == len(list(run.glob("particles_*.hdf"))), f"{run}: {len(times)} times")
    for time in times:
        reader.UpdateTimeStep(time)
        grids = vtk_grids(reader.GetOutputDataObject(0), f"{run}/levels.xdmf")
        need_equal(
            [grid.GetBounds() for grid in grids], [box.T.ravel() for box in BOXES], f"{run}: boxes at {time}"
        )


def check_probe(run):
    """A body in free flight: the probe keeps its place in it, but for a quarter of a particle's size when
    that is split."""
    _, rows = history(f"{run}/probe_corner.dat")
    middle, velocity, spin = numpy.array([7.0, 8, 8]), numpy.array([80.0, 3, 2]), numpy.array([0.0, 2, 10])
    rate = numpy.linalg.norm(spin)
    axis = spin / rate
    arm = rows[0, 1:4] - middle
    angle = (rate * rows[:, 0])[:, None]
    turned = (
        arm * numpy.cos(angle)
        + numpy.cross(axis, arm) * numpy.sin(angle)
        + axis * (axis @ arm) * (1 - numpy.cos(angle))
    )
    off = numpy.abs(rows[:, 1:4] - (middle + velocity * rows[:, :1] + turned)).max()
    print(f"   the probe is at most {off:.3f} m off the way of its place in the body")
    need(0.1 < off < 0.2, f"{run}: the probe is {off} m off")


def check_words(run, log):
    """Introduction and cost.dat."""
    text = Path(log).read_text()
    lines = re.findall(
        r"^level (\d)    \(.*\) to \(.*\), (\d+) cells of .*, \d+ blocks, (\d+) particles, steps of (.*) us$",
        text,
        re.M,
    )
    need(
        [(int(n), int(cells)) for n, cells, _, _ in lines] == [(1, 7168), (2, 13824), (3, 24576)],
        f"{log}: {lines}",
    )
    with h5py.File(min(run.glob("particles_*.hdf")), "r") as file:
        level = file["VTKHDF/PointData/level"][()]
    need_equal(
        [int(held) for _, _, held, _ in lines],
        [numpy.count_nonzero(level == n) for n in (1, 2, 3)],
        f"{log}: particles",
    )
    step = [float(time) for _, _, _, time in lines]
    need_equal(step, [step[0], step[0] / 2, step[0] / 4], f"{log}: steps", 1e-3)
    need(
        re.search(r"^cells      40768 on all levels, 8.89 % of the 458752 ", text, re.M) is not None,
        f"{log}: share of the cells",
    )
    header, _ = history(f"{run}/cost.dat")
    facts = dict(re.match(r'AUXDATA (\w+)="(.*)"', line).groups() for line in header[3:])
    steps = [int(facts[f"particle_steps_level_{n}"]) for n in (1, 2, 3)]
    need(min(steps) > 0 and sum(steps) == int(facts["particle_steps"]), f"{run}: particle-steps {steps}")
    columns = header[1].removeprefix("VARIABLES=").split(", ")
    rows = history(f"{run}/cost.dat")[1]
    need(rows.shape[1] == 13 and columns[7] == '"level 1 mean of the ranks [s]"', f"{run}: columns {columns}")
    names = [facts[f"phase_{n}"] for n in range(1, len(rows) + 1)]
    for row in ("P2G", "nodes", "G2P", "stress"):
        row = rows[names.index(row)]
        need(
            row[7::2].min() > 0 and abs(row[7::2].sum() / row[2] - 1) < 1e-12, f"{run}: a row by levels {row}"
        )
        need_equal(
            row[8::2],
            row[7::2] * 1e9 / numpy.array(steps) * int(facts["ranks"]),
            f"{run}: per particle-step",
            1e-12,
        )
    need(rows[names.index("output"), 7::2].max() == 0, f"{run}: no level pays for the output")
    for n in (1, 2, 3):
        need(
            re.search(rf"^level {n}: {steps[n - 1]} particle-steps, ", text, re.M) is not None,
            f"{log}: particle-steps",
        )


def main():
    vtk.vtkObject.GlobalWarningDisplayOff()
    one, two, log = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    failed = 0
    for check in (
        lambda: check_files(one, two),
        lambda: check_zones(one),
        lambda: check_outlines(one),
        lambda: check_probe(one),
        lambda: check_words(one, log),
    ):
        try:
            check()
        except FOUND as wrong:
            failed += 1
            print(f"FAILED {wrong}")
    return failed


if __name__ == "__main__":
    sys.exit(main())
