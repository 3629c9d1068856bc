"""Pressure pulses of 20, 10 and 5 cells pass a box of atoms in a bar. What the box throws back is the difference of
velocities from the same bar without atoms, in front of the box when the pulse is behind it: its energy relative to
that of the pulse."""

import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

from checks import finish, require

ARGON = "style='lj/smooth/linear', epsilon=1.65e-21, sigma=3.405e-10, cutoff=8.5e-10"
CONSTANT = 5.30529692155e-10
CELL = 4 * CONSTANT
SPEED = 1424.0  # of longitudinal waves along a cube axis, m/s
DENSITY = 1776.9
WIDE, BOX = 4, 4  # cells across the bar; along it, in the box


def numbers(*values):
    return ",".join(repr(float(v)) for v in values)


def run(name, length, atoms):
    """A pulse of `length` cells; the end of the run is when its middle is 0.8 lengths behind the box."""
    before = length + 2  # cells in front of the box
    total = before + BOX + int(1.5 * length) + 4
    base, wide, time = 2 * CELL, WIDE * CELL, length * CELL / SPEED
    end = (before + BOX + 1.3 * length) * CELL / SPEED
    t = np.linspace(0, time, 17)
    text = f"""&scene title='{name}', end_time={end!r} /
&grid lower=0,0,0, upper={numbers(wide, wide, base + (total + 2) * CELL)}, cell_size={CELL!r},
      boundary='roller','roller','roller','roller','free','free' /
&material name='m', model='cauchy_born', density={DENSITY}, {ARGON}, lattice='fcc', constant=5.27e-10 /
&body material='m', shape='box', lower={numbers(0, 0, base)}, upper={numbers(wide, wide, base + total * CELL)} /
&pressure lower={numbers(0, 0, base)}, upper={numbers(wide, wide, base)},
          times={numbers(*t)}, values={numbers(*2e7 * np.sin(np.pi * t / time) ** 2)} /
&output directory='{name}', every={end!r}, history_every={end!r} /
"""
    if atoms:
        text += f"""&atoms lower={numbers(CELL, CELL, base + before * CELL)},
       upper={numbers(3 * CELL, 3 * CELL, base + (before + BOX) * CELL)}, step=1e-14, mass=6.6335e-26,
       lattice='fcc', constant=5.27e-10, {ARGON} /
"""
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True)
    if atoms and "LAMMPS cannot be opened" in done.stdout + done.stderr:
        print("  left out, LAMMPS is not there: waves through a box of atoms")
        finish()
        sys.exit(0)
    require(f"{name}: status {done.returncode} {done.stderr[-300:]}", done.returncode == 0)
    last = max(Path(name).glob("particles_*.hdf"), key=lambda p: int(re.findall(r"\d+", p.name)[-1]))
    with h5py.File(last) as f:
        root = f["VTKHDF"]
        return np.array(root["Points"]), np.array(root["PointData/velocity"]), base + before * CELL, end


def main():
    for length, bound in ((20, 0.01), (10, 0.01), (5, None)):
        if len(sys.argv) > 1 and str(length) not in sys.argv[1:]:
            continue
        x, v, front, end = run(f"atoms_{length}", length, True)
        x0, v0, _, _ = run(f"none_{length}", length, False)
        here = x[:, 2] < front - CELL / 4
        keys = lambda p: np.lexsort(np.round(p / (CELL / 20)).T)  # noqa: E731
        x, v = x[here], v[here]
        there = x0[:, 2] < front - CELL / 4
        x0, v0 = x0[there], v0[there]
        x, v, x0, v0 = x[keys(x)], v[keys(x)], x0[keys(x0)], v0[keys(x0)]
        require("the same particles", len(x) == len(x0) and np.abs(x - x0).max() < CELL / 20)
        # a travelling wave has as much elastic as kinetic energy; all particles have the same mass
        mass = DENSITY * (CELL / 2) ** 3
        t = np.linspace(0, length * CELL / SPEED, 2001)
        pressure = 2e7 * np.sin(np.pi * t / t[-1]) ** 2
        sent = np.trapezoid(pressure**2, t) / (DENSITY * SPEED) * (WIDE * CELL) ** 2
        back = mass * ((v - v0) ** 2).sum() / sent
        share = (2 / WIDE) ** 2
        print(
            f"  pulse of {length} cells: thrown back {100 * back:.4f} % of all, "
            f"{100 * back / share:.4f} % of what meets the box"
        )
        if bound:
            require(f"{length} cells: at most 1 %", back / share < bound)
    finish()


main()
