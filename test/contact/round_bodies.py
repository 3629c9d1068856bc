"""Curved bodies under flat plates, and a sphere pressed deep into a block, with no word about how bodies are
filled or how domains deform (theory.md, Bodies that the lattice does not fit).
usage: round_bodies.py [long] (in an empty directory; GIMP3D is the program)"""

import sys
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from run_scene import History, run
from checks import check, finish, require

NU = 0.3
MODULUS = 1 / (1 - NU**2)  # Young's modulus and the radius are 1


def ball_load(approach, radius=1.0):
    """Load of an elastic ball between two flat plates, by how far each comes nearer to its centre: Hertz, and
    what the far side gives way by (Tatara 1991). Between two rigid spheres `radius` is that of both curvatures
    together."""

    def come(load):
        a = (0.75 * load * radius / MODULUS) ** (1 / 3)
        far = 2 * (1 + NU) / (a**2 + 4) ** 1.5 + (1 - NU**2) / (a**2 + 4) ** 0.5
        return a**2 / radius - far * load / np.pi

    return brentq(lambda load: come(load) - approach, 1e-12, 10)


class Metal:
    """A ball of metal that does not harden, E/Y = 220, flattened by a plate: Jackson and Green (2005), eqs 11
    to 15, over the approach at which it begins to flow."""

    yields = 1 / 220
    factor = 1.295 * np.exp(0.736 * NU)
    first = (np.pi * factor * yields / (2 * MODULUS)) ** 2  # approach
    first_load = 4 / 3 / MODULUS**2 * (np.pi * factor * yields / 2) ** 3

    def load(self, approach):
        w, strain = approach / self.first, self.yields / MODULUS
        radius = np.pi * self.factor * strain / 2 * np.sqrt(w) * (w / 1.9) ** (0.07 * np.exp(23 * strain))
        hardness = 2.84 * (1 - np.exp(-0.82 * radius**-0.7))
        elastic = np.exp(-0.25 * w ** (5 / 12)) * w**1.5
        return self.first_load * (
            elastic + 4 * hardness / self.factor * (1 - np.exp(-(w ** (5 / 9)) / 25)) * w
        )


def disk_load(approach):
    """Load per length of a disk between two plates (Johnson 1985, eq. 5.57)."""

    def come(load):
        a = np.sqrt(4 * load / (np.pi * MODULUS))
        return load / (np.pi * MODULUS) * (2 * np.log(4 / a) - 1)

    return brentq(lambda load: come(load) - approach, 1e-12, 0.5)


def pressed(name, cells, shape, deep, speed, words=""):
    """Load over approach of an eighth of a ball, or a quarter of a disk of one cell, with so many cells a
    radius, and what the run says."""
    cell = 1 / cells
    n = int(np.ceil(cells)) + 2
    slice_of = shape == "cylinder"
    lengths = [n * cell, cell if slice_of else n * cell, n * cell]
    sides = "'symmetry','free','symmetry','symmetry'" if slice_of else "'symmetry','free','symmetry','free'"
    axis = f", height={cell!r}, axis=0,1,0" if slice_of else ""
    said = run(
        f"&scene title='{name}', end_time={float(deep / speed + 1)!r} /\n"
        f"&grid lower=0,0,0, upper={','.join(map(repr, lengths))}, cell_size={cell!r}, "
        f"boundary={sides},'symmetry','free' /\n"
        f"&material name='m', model='elastic', density=1, young=1, poisson={NU} /\n"
        f"&body material='m', shape='{shape}', center=0,0,0, radius=1{axis}{words} /\n"
        f"&tool name='plate', shape='flat', radius=2, tip=0,0,1, times=0,2, speeds=0,{speed} /\n"
        f"&output directory='{name}', formats='none' /\n",
        1,
    )
    rows = History(Path(name) / "tool_plate.dat")
    share = 0.5 * cell if slice_of else 0.25
    return rows["depth"], rows["load_z"] / share, said


def off(depth, load, exact, at):
    """How far the load is off the exact one, in the mean over 7 % of the approach on either side."""
    near = np.abs(depth / at - 1) < 0.07
    return np.mean(load[near] / [exact(z) for z in depth[near]]) - 1


def ball(cells, speed, bounds):
    name = f"ball_{cells}"
    contact = [k / cells for k in bounds]
    come = [
        a**2 - (4 * MODULUS / 3 * a**3 / np.pi) * (2.6 / (a**2 + 4) ** 1.5 + (1 - NU**2) / (a**2 + 4) ** 0.5)
        for a in contact
    ]
    depth, load, said = pressed(name, cells, "sphere", 1.08 * come[-1], speed)
    for at, (k, bound) in zip(come, bounds.items()):
        check(f"ball of {cells} cells a radius, {k} a contact radius", off(depth, load, ball_load, at), bound)
    require(f"{name}: how it is filled is said", "cut by the surface" in said)
    require(f"{name}: so are the domains", "chosen     domain='corners'" in said)
    return come


def disk(cells, speed, bounds):
    name = f"disk_{cells}"
    come = [
        (a**2 / 4) * (2 * np.log(4 / a) - 1) for a in (k / cells for k in bounds)
    ]  # load = pi a^2 MODULUS / 4
    depth, load, said = pressed(name, cells, "cylinder", 1.08 * come[-1], speed)
    for at, (k, bound) in zip(come, bounds.items()):
        check(
            f"disk of {cells} cells a radius, {k} a contact half-width",
            off(depth, load, disk_load, at),
            bound,
        )
    notes = History(Path(name) / "cost.dat").notes
    check(
        f"disk of {cells} cells a radius: work of the condition of contact over the largest energy",
        float(notes["constraint_work_J"]) / float(notes["largest_energy_J"]),
        2e-3,
    )
    last = depth > 0.85 * come[-1]
    ratio = load[last] / [disk_load(z) for z in depth[last]]
    check(f"disk of {cells} cells a radius: largest change of the load between rows", np.diff(ratio), 0.02)


def whole(cells, speed, come):
    """The control: particles that are whole or not there make facets of a ball."""
    depth, load, said = pressed("whole", cells, "sphere", 1.08 * come, speed, ", fill='whole'")
    far = off(depth, load, ball_load, come)
    require(f"control: whole particles are far off ({100 * far:.1f} %)", far > 0.1)


def face(cells=6):
    """A cylinder pressed on its flat face, with whole particles under it: its domains stay cubes."""
    said = run(
        f"&scene title='face', end_time=0.1, mode='plan' /\n"
        f"&grid lower=0,0,0, upper={cells + 2},{cells + 2},{cells + 2}, cell_size=1, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        f"&material name='m', model='elastic', density=1, young=1, poisson={NU} /\n"
        f"&body material='m', shape='cylinder', center=0,0,0, radius={cells}, height={cells} /\n"
        f"&tool name='ball', shape='sphere', radius=3, tip=0,0,{cells}, times=0, speeds=0.01 /\n",
        1,
    )
    require("a cylinder pressed on its face: no domains are chosen", "chosen     domain" not in said)
    require("and it is cut all the same", "cut by the surface" in said)


def sphere_on_ball(cells, radius, bounds):
    """Two rigid spheres of another radius press a ball."""
    both, cell, speed, name = 1 / (1 + 1 / radius), 1 / cells, 0.004, f"on_{radius}"
    size = (int(cells) + 3) * cell
    deep = (1.05 * max(bounds) * cell) ** 2 / both
    run(
        f"&scene title='{name}', end_time={deep / speed + 1!r} /\n"
        f"&grid lower=0,0,0, upper={size!r},{size!r},{size!r}, cell_size={cell!r}, "
        "boundary='symmetry','free','symmetry','free','symmetry','free' /\n"
        f"&material name='m', model='elastic', density=1, young=1, poisson={NU} /\n"
        "&body material='m', shape='sphere', center=0,0,0, radius=1 /\n"
        f"&tool name='tip', shape='sphere', radius={radius}, tip=0,0,1, times=0,2, speeds=0,{speed} /\n"
        f"&output directory='{name}', formats='none' /\n",
        1,
    )
    rows = History(Path(name) / "tool_tip.dat")
    for k, bound in bounds.items():
        check(
            f"sphere of radius {radius} on a ball, {k} cells a contact radius",
            off(rows["depth"], 4 * rows["load_z"], lambda z: ball_load(z, both), (k * cell) ** 2 / both),
            bound,
        )


def flattened(bounds):
    """The ball of metal on three levels, with 4 to 12 cells a contact radius."""
    metal = Metal()
    run(
        "&scene title='flattened', end_time=9.5 /\n"
        "&grid lower=0,0,0, upper=1.15,1.15,1.15, cell_size=0.05, "
        "boundary='symmetry','free','symmetry','free','symmetry','free' /\n"
        "&level lower=0,0,0.7, upper=0.4,0.4,1.15 /\n&level lower=0,0,0.85, upper=0.2,0.2,1.15 /\n"
        f"&material name='m', model='j2', density=1, young=1, poisson={NU}, yield_stress={metal.yields!r} /\n"
        "&body material='m', shape='sphere', center=0,0,0, radius=1 /\n"
        "&tool name='plate', shape='flat', radius=2, tip=0,0,1, times=0,2,4.5,5.5, "
        "speeds=0,0.001,0.001,0.003 /\n"
        "&output directory='flattened', formats='none' /\n",
        1,
    )
    rows = History(Path("flattened") / "tool_plate.dat")
    for w, bound in bounds.items():
        near = np.abs(rows["depth"] / (w * metal.first) - 1) < 0.05
        far = np.mean(4 * rows["load_z"][near] / metal.load(rows["depth"][near])) - 1
        check(f"ball of metal, flattened to w* = {w}: load", far, bound)
    elastic = np.mean([ball_load(z) for z in rows["depth"][near]]) / np.mean(4 * rows["load_z"][near])
    require(f"control: an elastic ball would bear {elastic:.1f} times as much", elastic > 2)


def deep(bounds):
    """A sphere of 2.7 cells a radius buried in a block, one particle a cell: against finite elements."""
    speed, end = 150.8, 3.2e-6
    said = run(
        f"&scene title='deep', end_time={end / speed + 1.45e-9!r} /\n"
        "&grid lower=0,0,0, upper=61.44e-6,61.44e-6,38.4e-6, cell_size=1.28e-6, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        "&material name='m', model='elastic', density=2710, young=70e9, poisson=0.33 /\n"
        "&body material='m', shape='box', lower=0,0,0, upper=56.32e-6,56.32e-6,32e-6, "
        "particles_per_cell=1 /\n"
        "&tool name='ball', shape='sphere', radius=3.4e-6, tip=0,0,32e-6, times=0,2.9e-9, "
        f"speeds=0,{speed} /\n"
        "&output directory='deep', formats='none' /\n",
        1,
    )
    rows = History(Path("deep") / "tool_ball.dat")
    for at, exact in {2e-6: 145.1e-3, 2.73e-6: 229.7e-3, 3.11e-6: 278.1e-3}.items():
        near = np.abs(rows["depth"] / at - 1) < 0.06
        fit = np.polyfit(rows["depth"][near], rows["load_z"][near], 1)
        check(
            f"deep sphere, {1e6 * at:.2f} um: load against finite elements",
            np.polyval(fit, at) / exact - 1,
            bounds,
        )
    require("deep: domains are chosen", "chosen     domain='corners'" in said)


def rolling():
    """A ball of five cells a radius rolls down a standing cylinder four times as large: the speed that what it
    has fallen by gives a ball that does not slip. It is pressed in by a hundredth, on 0.8 cells a contact
    radius, and rocks on it as it rolls, about twice in 40 s, by a fifth of its spin, so that speed and spin
    are their means over that time. Carter's creep is about 1 %."""
    gravity, far, start = 2e-3, 4.96, np.radians(20)
    x, z = (float(5 * f(start)) for f in (np.sin, np.cos))
    run(
        "&scene title='rolling', end_time=62 /\n"
        "&grid lower=-0.6,0,0.6, upper=6,1.4,6.4, cell_size=0.2, "
        "boundary='free','free','symmetry','free','free','free' /\n"
        "&material name='m', model='elastic', density=1, young=1, poisson=0.3 /\n"
        f"&body material='m', shape='sphere', center={x!r},0,{z!r}, radius=1 /\n"
        "&tool name='hill', shape='cylinder', radius=4, edge=0,1,0, tip=0,0,4, axis=0,0,1, "
        "times=0, speeds=0, friction=0.6 /\n"
        f"&gravity acceleration=0,0,{-gravity} /\n"
        "&output directory='rolling', formats='none', history_every=0.25 /\n",
        1,
    )
    rows = History(Path("rolling") / "energy.dat")
    time = rows["time"]
    speed = [rows[f"momentum_{axis}"] / rows["mass"][0] for axis in "xz"]
    way = [np.append(0, np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(time))) for v in speed]
    angle = np.arctan2(x + way[0], z + way[1])
    along = speed[0] * np.cos(angle) - speed[1] * np.sin(angle)
    exact = np.sqrt(10 / 7 * gravity * far * np.maximum(0, np.cos(start) - np.cos(angle)))
    arm = x + way[0], z + way[1]
    spin = rows["angular_momentum_y"] - arm[1] * rows["momentum_x"] + arm[0] * rows["momentum_z"]
    spin /= 0.4 * rows["mass"][0]
    rolls = time > 22
    check(
        "ball that rolls down a cylinder: speed over the exact one, in the mean",
        along[rolls].mean() / exact[rolls].mean() - 1,
        0.015,
    )
    check(
        "ball that rolls down a cylinder: spin times radius over its speed, in the mean",
        spin[rolls].mean() / along[rolls].mean() - 1,
        0.1,
    )
    last = time > 58
    moving = np.sqrt((along[last] ** 2 + 0.4 * spin[last] ** 2) / 1.4)
    check(
        "ball that rolls down a cylinder: speed by its energy over the exact one, at the end",
        moving.mean() / exact[last].mean() - 1,
        0.025,
    )


if sys.argv[1:] == ["long"]:
    rolling()
    for cells in (15, 15.33, 15.67):
        ball(cells, 0.003, {2: 0.05, 3.5: 0.03, 5: 0.02})
        disk(cells, 0.003, {2: 0.05, 3.5: 0.03, 5: 0.02})
    deep(0.05)
    for cells, radius in ((15, 1.0), (15.5, 2.0)):
        sphere_on_ball(cells, radius, {2: 0.05, 3: 0.05, 4: 0.05})
    flattened({18: 0.05, 30: 0.05, 60: 0.05, 100: 0.05, 150: 0.05})
else:
    come = ball(11, 0.005, {2: 0.05, 3.5: 0.03})
    whole(11, 0.005, come[0])
    disk(15, 0.005, {2: 0.05, 3.5: 0.03})
    disk(15.67, 0.003, {5: 0.02})  # where a second layer is near below thin cut particles
    face()
finish()
