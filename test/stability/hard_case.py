"""What the hard cases share: a bench that runs scenes and test programs, figures with their bars, pictures,
the table of it all."""

import atexit
import csv
import fcntl
import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from gimp3d.run_data import History, Particles

LIMIT = 900  # s: a run that takes longer hangs
COLUMNS = ("case", "figure", "sense", "bar", "value", "verdict", "seconds", "ranks", "build")
CASES = {}  # name -> Case, in the order of the files


@dataclass
class Case:
    """A hard case: the function that runs it on a bench, and whether its short form belongs to `make
    test`."""

    name: str
    function: object
    short: bool


def hard_case(name, short=False):
    """Decorator: enter a function of a bench as a case."""

    def enter(function):
        if name in CASES:
            raise ValueError(f"the case {name} stands twice")
        CASES[name] = Case(name, function, short)
        return function

    return enter


def surroundings():
    """The environment of a run: programs that run without mpirun would all share one directory of Open MPI's,
    and the first to end would remove it under the others."""
    here = tempfile.mkdtemp(prefix="gimp3d_")
    atexit.register(shutil.rmtree, here, ignore_errors=True)
    return os.environ | {"OMPI_MCA_orte_tmpdir_base": here}


class Ended(Exception):
    """A run ended as it should not have; the text says how."""


class Outcome:
    """What a run of a scene left: its status, its sentence when that is not 0, its files."""

    def __init__(self, directory, status, output):
        self.directory, self.status, self.output = Path(directory), status, output
        found = re.findall(r"^gimp3d: (.*)", output, re.M)
        self.sentence = found[-1] if found else ""

    def history(self, name):
        """A history whose every number is finite."""
        path = self.directory / f"{name}.dat"
        history = History(path)
        for column, values in history.columns.items():
            if not np.all(np.isfinite(values)):
                raise Ended(f"{path}: {column} is not finite")
        if history.rows < 2:
            raise Ended(f"{path}: {history.rows} rows")
        return history

    @property
    def energy(self):
        return self.history("energy")

    def tool(self, name="tool"):
        return self.history(f"tool_{name}")

    def snapshots(self):
        """The snapshots in the order of time, every field finite."""
        found = [Particles(path) for path in sorted(self.directory.glob("particles_*.hdf"))]
        for one in found:
            for name, data in one.fields.items():
                if not np.all(np.isfinite(data)):
                    raise Ended(f"{self.directory}: {name} is not finite at {one.time:.4g} s")
        return found


@dataclass
class Figure:
    """One figure of a case and its bar. A control is the setting that is known to fail: it must miss the
    bar."""

    what: str
    value: float
    bar: float
    least: bool = False
    control: bool = False
    known: bool = False  #: it misses its bar, and doc/user/hard_cases.md says so

    @property
    def met(self):
        if not np.isfinite(self.value):
            return self.control
        return (self.value >= self.bar if self.least else self.value <= self.bar) != self.control

    @property
    def sense(self):
        return "control: fails " * self.control + ("at least" if self.least else "at most")

    @property
    def verdict(self):
        return "met" if self.met else "open" if self.known else "MISSED"


@dataclass
class Bench:
    """Where a case runs: program, test programs, ranks, its own directory; what it found."""

    program: Path
    programs: Path
    ranks: int
    short: bool
    work: Path
    figures: list = field(default_factory=list)
    plot: object = None
    environment: dict = field(default_factory=surroundings)

    def pick(self, full, short):
        """The size of a case: that of `make hard`, or that of `make test`."""
        return short if self.short else full

    def command(self, path, *arguments):
        """On one rank without mpirun, which takes a second."""
        return (["mpirun", "-n", str(self.ranks)] if self.ranks > 1 else []) + [str(path), *arguments]

    def run(self, name, text, allowed=(0,)):
        """Run a scene whose &output goes to 'OUT'; a status that is not allowed ends the case."""
        out = self.work / name
        text = text.replace("'OUT'", f"'{out}'")
        (self.work / f"{name}.nml").write_text(text)
        try:
            done = subprocess.run(
                self.command(self.program),
                input=text,
                capture_output=True,
                text=True,
                timeout=LIMIT,
                env=self.environment,
            )
        except subprocess.TimeoutExpired:
            raise Ended(f"{name} was still running after {LIMIT} s")
        outcome = Outcome(out, done.returncode, done.stdout + done.stderr)
        (self.work / f"{name}.log").write_text(outcome.output)
        if outcome.status not in allowed:
            raise Ended(
                f"{name} ended with status {outcome.status}: {outcome.sentence or outcome.output[-300:]}"
            )
        return outcome

    def measure(self, name, *arguments):
        """Run a test program of this folder; what it prints as `figure NAME VALUE`, in a dictionary."""
        try:
            done = subprocess.run(
                self.command(self.programs / name, *map(str, arguments)),
                capture_output=True,
                text=True,
                timeout=LIMIT,
                env=self.environment,
            )
        except subprocess.TimeoutExpired:
            raise Ended(f"{name} was still running after {LIMIT} s")
        found = {
            key: float(value) for key, value in re.findall(r"^ *figure +(\S+) +(\S+)", done.stdout, re.M)
        }
        if done.returncode != 0 or not found:
            raise Ended(
                f"{name} {' '.join(map(str, arguments))} ended with status {done.returncode}: "
                f"{(done.stdout + done.stderr)[-300:]}"
            )
        return found

    def at_most(self, what, value, bar, **kind):
        self.figures.append(Figure(what, float(np.max(value)), bar, **kind))

    def at_least(self, what, value, bar, **kind):
        self.figures.append(Figure(what, float(np.min(value)), bar, least=True, **kind))

    def picture(self, draw):
        """Keep how the case is drawn: draw(axes) is called when pictures are wanted."""
        self.plot = draw


def run_case(case, bench):
    """Run a case in its own directory; its rows of the table. A run that ends as it should not is a missed
    figure."""
    start = time.time()
    try:
        case.function(bench)
    except (Ended, OSError, ValueError, KeyError) as error:
        print(f"   {case.name}: {error}", flush=True)
        bench.figures.append(Figure("runs that ended as they should not", 1, 0))
    seconds = time.time() - start
    build = os.environ.get("BUILD", "opt")
    return [
        dict(
            zip(
                COLUMNS,
                (
                    case.name,
                    one.what,
                    one.sense,
                    f"{one.bar:.4g}",
                    f"{one.value:.4g}",
                    one.verdict,
                    f"{seconds:.0f}",
                    str(bench.ranks),
                    build,
                ),
            )
        )
        for one in bench.figures
    ]


def draw(bench, name, path):
    """The picture of a case, if it has one."""
    if bench.plot is None:
        return
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(4, 3), dpi=80, layout="constrained")
    axes.set_title(name, fontsize=9)
    bench.plot(axes)
    axes.tick_params(labelsize=7)
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_size(8)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=6)
    figure.savefig(path)
    pyplot.close(figure)


def read_table(path):
    if not path.exists():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def replace_rows(path, case, rows):
    """Put the rows of a case into a table, in the order of the cases; several galleries may write the same
    table."""
    with open(path.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        order = {name: n for n, name in enumerate(CASES)}
        others = [row for row in read_table(path) if row["case"] != case and row["case"] in order]
        write_table(path, sorted(others + rows, key=lambda row: order[row["case"]]))


def write_table(path, rows):
    new = path.with_suffix(".part")
    with open(new, "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    new.rename(path)
