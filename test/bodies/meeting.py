"""What the scripts of this suite share: scenes of bodies that meet, what their runs wrote, the figures of
cases by name.

usage of each script: NAME.py CASE... (in an empty directory; GIMP3D is the program)"""

import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from gimp3d.run_data import History, Particles
from checks import check, finish, require

YOUNG, DENSITY = 1e9, 1000.0  # Pa, kg/m3
BAR_WAVE = math.sqrt(YOUNG / DENSITY)  # m/s


class Run:
    """A scene that has run: its log, its histories, its last snapshot."""

    def __init__(self, name, text, ranks=1, arguments=(), allowed=0):
        self.directory = Path(name)
        shutil.rmtree(self.directory, ignore_errors=True)
        command = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [os.environ["GIMP3D"], *arguments]
        done = subprocess.run(
            command, input=text.replace("'OUT'", f"'{name}'"), capture_output=True, text=True
        )
        self.log, self.status = done.stdout + done.stderr, done.returncode
        Path(f"{name}.nml").write_text(text.replace("'OUT'", f"'{name}'"))
        if done.returncode != allowed:
            sys.exit(f"FAILED: {name} ended with status {done.returncode}:\n{text}\n{self.log[-1500:]}")

    def history(self, name):
        found = History(self.directory / f"{name}.dat")
        for column, values in found.columns.items():
            require(f"{self.directory}/{name}.dat: {column} is finite", bool(np.all(np.isfinite(values))))
        return found

    @property
    def energy(self):
        return self.history("energy")

    def force(self, one="a", other="b"):
        """Time (s) and force on the first group (rows, 3; N)."""
        rows = self.history(f"contact_{one}_{other}")
        return rows["time"], np.stack([rows[f"force_{axis}"] for axis in "xyz"], axis=1)

    def last(self):
        return Particles(sorted(self.directory.glob("particles_*.hdf"))[-1])

    def said(self, pattern):
        """A number of the closing summary."""
        found = re.search(pattern, self.log, re.M)
        return float(found[1]) if found else math.nan


def impulse(time, force):
    """Sum over time of a history that has every step (its steps are of one length): what each row has given
    up to its time."""
    steps = np.diff(time, prepend=0.0)
    return np.cumsum(force * (steps[:, None] if force.ndim > 1 else steps), axis=0)


def numbers(*values):
    return ",".join(f"{value!r}" for value in map(float, np.ravel(values)))


def group(name):
    """The variable of a body's contact group; none for the control, in which all bodies share a velocity
    field."""
    return f", contact_group='{name}'" if name else ""


def main(cases):
    """Run the cases that the command line names."""
    for name in sys.argv[1:]:
        cases[name]()
    finish()
