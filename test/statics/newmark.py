"""Implicit steps with inertia, &quasi_static mode='newmark', against exact answers (theory.md, Implicit
steps with inertia). usage: newmark.py (in an empty directory; GIMP3D is the program)"""

import os
import subprocess
from pathlib import Path

import numpy as np

from static_scenes import History, check, counts, finish, last_particles, require, run, tool

CELLS = 16  # along the bar, one thick; E = density = cell = 1, so that waves take 16 s
PERIOD = 4.0 * CELLS
SPEED = 1e-3
GRID = (
    "&grid lower=0,0,0, upper={upper},{across},{across}, cell_size=1, "
    "boundary='{side}','free','symmetry','symmetry','symmetry','symmetry' /\n"
    "&material name='bar', model='elastic', density=1, young=1, poisson=0 /\n"
)


def bar(name, steps, mode="mode='newmark'", periods=2, more="", across=2):
    """A bar that is held at x = 0 and begins with the velocities of its first mode: a slice for each layer of
    particles."""
    slices = "".join(
        f"&body material='bar', shape='box', lower={k / 2},0,0, upper={(k + 1) / 2},{across},{across}, "
        f"velocity={SPEED * np.sin(np.pi * (k + 0.5) / (4 * CELLS))},0,0 /\n"
        for k in range(2 * CELLS)
    )
    return (
        f"&scene title='{name}', end_time={periods * PERIOD} /\n"
        + GRID.format(upper=CELLS + 2, side="symmetry", across=across)
        + slices
        + f"&quasi_static {mode}, step={PERIOD / steps}, max_step={PERIOD / steps} /\n"
        f"&output directory='{name}', history_every=1e-9 /\n{more}"
    )


def energy(name):
    history = History(Path(name) / "energy.dat")
    return history, history["kinetic"] + history["strain"]


def swing(name):
    """Period and decay of an oscillation, by what has grown of the momentum's logarithm along its own
    recurrence p(n+1) + s p(n-1) = c p(n): both exact for one mode."""
    p = energy(name)[0]["momentum_x"]
    step = np.diff(energy(name)[0]["time"])[0]
    c, s = np.linalg.lstsq(np.stack([p[1:-1], -p[:-2]], axis=1), p[2:], rcond=None)[0]
    return 2 * np.pi * step / np.arccos(c / (2 * np.sqrt(s))) / PERIOD, -np.log(s) / (2 * step) * PERIOD


def root(steps, theta):
    """Of one mode, how its oscillation goes on in a step: exact for the rule."""
    w = 2 * np.pi / steps
    ahead = np.array([[1, -theta], [w * w * theta, 1]])
    behind = np.array([[1, 1 - theta], [-w * w * (1 - theta), 1]])
    return np.linalg.eigvals(np.linalg.solve(ahead, behind))[0]


def vibrates():
    """Period and decay are those of the rule, to what the cells are off by ((k h)^2 / 24 = 4.0e-4); the
    error of the period goes with the square of the step; energy stays. Without inertia nothing swings."""
    errors = []
    for steps in (10, 20, 40):
        name = f"bar_{steps}"
        log = run(bar(name, steps, periods=3), 1)
        period, decay = swing(name)
        exact = 2 * np.pi / steps / abs(np.angle(root(steps, 0.5)))
        check(
            f"{steps} steps a period: period over that of the rule, less 1", period / exact - 1 - 4e-4, 1e-4
        )
        check(f"{steps} steps a period: decay a period", decay, 1e-4)
        errors.append(period - 1 - 4e-4)
        total = energy(name)[1]
        check(f"{steps} steps a period: drift of the energy, two periods", total[-1] / total[steps] - 1, 1e-3)
        require(f"{steps} steps a period: Newton", counts(log, "newmark")[1] <= 2)
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    check("order of the period's error, less 2", orders - 2, 0.1)
    for theta in (0.6, 1):
        name = f"damped_{theta}"
        run(bar(name, 20, f"mode='newmark', theta={theta}", periods=1), 1)
        decay = swing(name)[1]
        check(
            f"theta={theta}: decay over that of the rule, less 1",
            decay / (-20 * np.log(abs(root(20, theta)))) - 1,
            5e-3,
        )
    log = run(bar("still", 20, "mode='static'", periods=1), 1, allowed=(2,))
    require("without inertia: velocities are refused", "not with &quasi_static from the start" in log)


def goes_on():
    """The same on two ranks, and after a restart."""
    text = bar("once", 20, periods=1)
    run(text, 1)
    run(bar("ranks", 20, periods=1), 2)
    once, ranks = last_particles("once"), last_particles("ranks")
    for name in ("velocity", "stress"):
        check(f"2 ranks: {name}, relative", (ranks[name] - once[name]) / np.abs(once[name]).max(), 1e-6)
    run(bar("again", 20, periods=1, more="&checkpoint every_steps=12 /\n"), 1)
    sorted(Path("again").glob("checkpoint_*.h5"))[-1].unlink()
    done = subprocess.run(
        ["mpirun", "-n", "1", os.environ["GIMP3D"], "--restart", "again"], capture_output=True
    )
    require("restart: status", done.returncode == 0)
    again = last_particles("again")
    for name in ("velocity", "stress"):
        check(f"restart: {name}, relative", (again[name] - once[name]) / np.abs(once[name]).max(), 1e-5)


def on_levels():
    """A bar whose middle is on a level of its own swings as one without."""
    run(bar("levels", 20, more="&level lower=5,0,0, upper=11,4,4 /\n", across=4), 2)
    require("levels: both have particles", len(np.unique(last_particles("levels")["level"])) == 2)
    period, decay = swing("levels")
    exact = np.pi / 20 / np.arctan(np.pi / 20)
    check("on two levels: period over that of the rule, less 1", period / exact - 1, 4.5e-4)
    check("on two levels: decay a period", decay, 1e-3)
    total = energy("levels")[1]
    check("on two levels: drift of the energy in a period", total[-1] / total[20] - 1, 1e-3)


def falls():
    """A bar in free fall is where it has to be."""
    time = 32.0
    run(
        f"&scene title='fall', end_time={time} /\n"
        + GRID.format(upper=CELLS + 4, side="free", across=2)
        + f"&body material='bar', shape='box', lower=2,0,0, upper={CELLS + 2},2,2, velocity=0.01,0,0 /\n"
        "&gravity acceleration=1e-3,0,0 /\n"
        f"&quasi_static mode='newmark', step={time / 8} /\n&output directory='fall', history_every=1e-9 /\n",
        1,
    )
    fall = last_particles("fall")
    check("free fall: velocity, relative", fall["velocity"][:, 0] / (0.01 + 1e-3 * time) - 1, 1e-9)
    centre = fall["mass"] @ fall["position"][:, 0] / fall["mass"].sum()
    check("free fall: centre, cells", centre - (2 + CELLS / 2 + 0.01 * time + 0.5e-3 * time**2), 1e-9)


def bounce(steps, theta):
    """A bar that flies against a wall, so many steps in the time that a wave takes to its end and back."""
    time, name = 32.0, f"bounce_{steps}_{theta}"
    run(
        f"&scene title='bounce', end_time={2.5 * time} /\n"
        + GRID.format(upper=CELLS + 8, side="free", across=2)
        + f"&body material='bar', shape='box', lower=4,0,0, upper={CELLS + 4},2,2, velocity={-SPEED},0,0 /\n"
        "&tool name='wall', shape='flat', radius=9, tip=4,0,0, axis=1,0,0, times=0, speeds=0 /\n"
        f"&quasi_static mode='newmark', step={time / steps}, theta={theta} /\n"
        f"&output directory='{name}', history_every=1e-9 /\n",
        1,
    )
    history, total = energy(name)
    wall = tool(name, "wall")
    load = -wall["load_x"] / (SPEED * 4)
    middle = (wall["time"] > 0.2 * time) & (wall["time"] < 0.9 * time)
    momentum = history["momentum_x"] / (SPEED * 4 * CELLS)
    impulse = (load * np.diff(wall["time"], prepend=0)).sum() / CELLS
    check(
        f"{name}: momentum over the wall's impulse, less 1", (momentum[-1] - momentum[0]) / impulse - 1, 1e-6
    )
    require(f"{name}: no gain of energy", total.max() / total[0] < 1.001)
    contact = wall["time"][load > 1e-6].max() / time
    return load[middle], contact, -momentum[-1] / momentum[0], 1 - total[-1] / total[0]


def bounces():
    """It leaves the wall with most of its momentum; the load is that of a wave, and swings about it as the
    steps let it."""
    load, contact, momentum, lost = bounce(80, 0.5)
    check("bounce: load over that of a wave, less 1, mean", load.mean() - 1, 0.01)
    check("bounce: the same, root of the mean square", load.std(), 0.02)
    check("bounce: time of contact over twice that of a wave, less 1", contact - 1, 0.05)
    check("bounce: momentum after against before, less 1", momentum - 1, 0.08)
    check("bounce: energy that is lost", lost, 0.08)
    require("bounce in 20 steps: the load swings", bounce(20, 0.5)[0].std() > 0.3)
    damped, _, _, taken = bounce(20, 0.6)
    check("bounce in 20 steps, theta=0.6: root of the mean square", damped.std(), 0.07)
    check("bounce in 20 steps, theta=0.6: energy that is lost, less 0.28", taken - 0.28, 0.02)


def refuses():
    pushed = (
        "&tool name='wall', shape='flat', radius=9, tip=17,0,0, axis=-1,0,0, times=0, loads=1, mass=1 /\n"
    )
    for words, mode, more in (
        ("tools have no mass", "mode='newmark'", pushed),
        ("allowed: 0 with mode='newmark'", "mode='newmark'", "&contact subcell=0.2 /\n"),
        ("is for mode='newmark'", "theta=0.7", ""),
        ("follow their own", "mode='newmark', ramp=1", ""),
    ):
        require(f"refused: {words}", words in run(bar("refused", 20, mode, more=more), 1, allowed=(2,)))


if __name__ == "__main__":
    vibrates()
    goes_on()
    on_levels()
    falls()
    bounces()
    refuses()
    finish()
