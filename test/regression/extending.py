"""The two halves of extending.sh.

extract TEXT TREE   put the Fortran blocks of TEXT where the paragraph before each says: a new file, a line of
a list, a scene (here) check RUN LOG       compare what the run of the law and the effect wrote and said with
the exact answer that TEXT gives ring RUN, dragged RUN, braked RUN   the same of the runs of the shape, of the friction, and of the
format and the number that is kept"""

import cmath
import re
import sys
from pathlib import Path

import h5py
import numpy as np

from checks import close
from runs import *


def extract(text, tree):
    """The last `path` of the paragraph before a block is where it belongs."""
    placed = 0
    for before, is_diff, block in re.findall(
        r"((?:[^\n]+\n)+)\n```(?:fortran|(diff))\n(.*?)^```", Path(text).read_text(), re.M | re.S
    ):
        path = re.findall(r"`([\w/]+\.\w+)`", before)[-1]
        if is_diff:
            change(Path(tree) / path, block)
        elif path.endswith(".nml"):
            Path(path).write_text(block)
        elif (Path(tree) / path).exists():
            lines = (Path(tree) / path).read_text().splitlines(keepends=True)
            last = max(n for n, line in enumerate(lines) if line.rstrip().endswith("; end block"))
            lines.insert(last + 1, block)
            (Path(tree) / path).write_text("".join(lines))
        else:
            (Path(tree) / path).write_text(block)
        placed += 1
    require(f"{text}: sixteen blocks, not {placed}", placed == 16)


def change(path, diff):
    """Hunks behind `@@`: each must fit in one place."""
    text = path.read_text()
    for hunk in re.split(r"^@@\n", diff, flags=re.M):
        lines = hunk.splitlines(keepends=True)
        old = "".join(line[1:] for line in lines if line[0] in " -")
        require(f"{path}: one place for {old!r}", text.count(old) == 1)
        text = text.replace(old, "".join(line[1:] for line in lines if line[0] in " +"))
    path.write_text(text)


def mode(t, omega, tau, drive):
    """q'' + tau omega^2 q' + omega^2 q = sin(drive t) from rest."""
    half = 0.5 * tau * omega**2
    size = (omega**2 - drive**2) ** 2 + (2 * half * drive) ** 2
    a, b = (omega**2 - drive**2) / size, -2 * half * drive / size
    free = cmath.sqrt(omega**2 - half**2)
    c = -b
    s = (half * c - a * drive) / free
    decaying = np.exp(-half * t) * (c * np.cos(free * t) + s * np.sin(free * t))
    return np.real(a * np.sin(drive * t) + b * np.cos(drive * t) + decaying)


def column(t, z, tau):
    """Displacement of the column of doc/developer/extending.md at the height z."""
    height, speed, amplitude, frequency = 0.8, 10.0, 0.05, 3.125
    u = 0.0
    for n in range(1, 13):
        number = (n - 0.5) * np.pi
        u = u + 2 * amplitude / number * np.sin(number * z / height) * mode(
            t, number * speed / height, tau, 2 * np.pi * frequency
        )
    return u


def check_run(run, log):
    probe = History(Path(run) / "probe_top.dat")
    z = next(values for name, values in probe.columns.items() if name.endswith("_z") or name == "z")
    t = probe["time"]
    moved, exact, undamped = z - z[0], column(t, z[0], 4e-3), column(t, z[0], 1e-9)
    scale = np.abs(exact).max()
    require(f"{run}: five periods of the first mode", t[-1] > 1.59 and len(t) > 150)
    check("displacement of the top off the sum of modes, over the largest", (moved - exact) / scale, 0.02)
    # the law must matter: without its dashpot the answer would be far away
    require("the dashpot takes a third", np.abs(undamped).max() > 1.4 * scale)
    said = Path(log).read_text()
    require(
        "the effect is on and carries nothing",
        re.search(r"^effects .*shaking \(0 B a particle\)", said, re.M),
    )
    require(
        "the law carries six columns",
        re.search(r"^fields .*velocity_gradient 9, spring_stress 6, ", said, re.M),
    )
    require("the effect has its row", re.search(r"^shaking  ", said, re.M))


def check_ring(run):
    energy, tool = History(Path(run) / "energy.dat"), History(Path(run) / "tool_ring.dat")
    ball, ring = 4 / 3 * np.pi * 0.4**3, 2 * np.pi**2 * 0.5 * 0.15**2
    check("mass over that of a ball and a ring, less 1", energy["mass"][0] / (1000 * (ball + ring)) - 1, 1e-3)
    t, load, momentum = tool["time"], tool["load_z"], energy["momentum_z"]
    touched = (0.4 - np.sqrt(0.55**2 - 0.5**2)) / 1.0
    check(
        "begin of contact off that of a smooth ball, s (0.05: a particle)",
        t[np.argmax(load < 0)] - touched,
        0.05,
    )
    require("the ball is thrown back", momentum[-1] > -0.5 * momentum[0] > 0 and not load[-1] < 0)
    scale = np.abs(momentum).max()
    impulse = -np.sum(0.5 * (load[1:] + load[:-1]) * np.diff(t))
    check(
        "impulse of the held ring off the change of momentum, over the first",
        (impulse - momentum[-1] + momentum[0]) / scale,
        0.02,
    )
    for axis in "xy":
        check(f"momentum along {axis}, over the first", energy[f"momentum_{axis}"] / scale, 1e-3)
    check("overlap, in cells", tool["max_gap_violation"] / 0.1, 0.05)


def check_dragged(run):
    tool = History(Path(run) / "tool_t.dat")
    friction, pressing = abs(tool["load_x"][-1]), abs(tool["load_z"][-1])
    close("friction with cohesion", friction, 0.05 * pressing + 20 * 16, 1e-6)
    require("both parts of it matter", 0.05 * pressing > 100)


def check_braked(run):
    run = Path(run)
    energy = History(run / "energy.dat")
    with h5py.File(max(run.glob("checkpoint_*"))) as file:
        peak = float(np.ravel(file["state/peak_kinetic"])[0])
    close("largest kinetic energy, J", peak, 128.0, 1e-9)
    require("the block is slower by then", energy["kinetic"][-1] < 0.5 * peak)
    tables = sorted(run.glob("particles_*.csv"))
    require("a CSV file beside each HDF5 file", len(tables) == len(list(run.glob("particles_*.hdf"))) >= 2)
    for path in tables:
        rows = np.genfromtxt(path, delimiter=",", names=True)
        with h5py.File(path.with_suffix(".hdf")) as file:
            points, data = file["VTKHDF/Points"][:], file["VTKHDF/PointData"]
            order, mine = np.argsort(data["id"][:]), np.argsort(rows["id"])
            require(f"{path}: the same ids", np.array_equal(data["id"][:][order], rows["id"][mine]))
            for axis, name in enumerate("xyz"):
                require(f"{path}: {name}", np.array_equal(points[order, axis], rows[name][mine]))
            require(f"{path}: mass", np.array_equal(data["mass"][:][order], rows["mass"][mine]))


if sys.argv[1] == "extract":
    extract(*sys.argv[2:])
elif sys.argv[1] == "ring":
    check_ring(*sys.argv[2:])
elif sys.argv[1] == "braked":
    check_braked(*sys.argv[2:])
elif sys.argv[1] == "dragged":
    check_dragged(*sys.argv[2:])
else:
    check_run(*sys.argv[2:])
finish()
