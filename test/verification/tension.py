"""Bars that hang, brought to rest, against the exact stretch; a beam that bends and comes to rest; cubes that
come apart. usage: tension.py [long] (in an empty directory; GIMP3D is the program)"""

import sys

import numpy as np

from run_scene import run
from checks import check, finish, require
from runs import energy, same_bits, snapshots

DENSITY, SHEAR, BULK, SIDE = 1050.0, 1e6 / 2.6, 1e6 / 1.2, 0.1
LAW = f"&material name='rubber', model='neo_hookean', density={DENSITY}, young=1e6, poisson=0.3 /\n"


def stress(stretch):
    """Cauchy stress along the axis in uniaxial strain (theory.md, eq. neo-hookean), Pa; so it is the first
    Piola-Kirchhoff stress."""
    return SHEAR * stretch ** (-5 / 3) * 2 / 3 * (stretch**2 - 1) + BULK * (stretch - 1)


def hanging(top):
    """Gravity that stretches a bar of 1 m to `top` at its top, m/s2; how far its end comes down, m; the work
    of gravity, J."""
    gravity = stress(top) / DENSITY
    place = np.linspace(0, 1, 4001)  # from the end
    low, high = np.ones_like(place), np.full_like(place, top + 0.01)
    for _ in range(60):
        middle = 0.5 * (low + high)
        short = stress(middle) < DENSITY * gravity * place
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    stretch = 0.5 * (low + high)
    way = np.concatenate([[0], np.cumsum(0.5 * (stretch[1:] + stretch[:-1]) - 1)]) * place[1]
    return gravity, way[-1], DENSITY * gravity * SIDE**2 * np.trapezoid(way[-1] - way, place)


def bar(directory, domain, particles, gravity, room, end=0.8):
    return (
        f"&scene title='bar', end_time={end} /\n&grid lower=0,0,{-1 - room:.1f}, upper={SIDE},{SIDE},0, "
        f"cell_size={SIDE},\n"
        "boundary='symmetry','symmetry','symmetry','symmetry','free','symmetry' /\n"
        f"&time domain='{domain}' /\n{LAW}&body material='rubber', shape='box', lower=0,0,-1, "
        f"upper={SIDE},{SIDE},0, particles_per_cell={particles} /\n&gravity acceleration=0,0,{-gravity!r} /\n"
        f"&damping kind='viscous', coefficient=80 /\n&output directory='{directory}', every={end}, "
        f"history_every={end / 40} /\n"
    )


def lowest(one):
    """The lowest face, m."""
    if "domain" in one.fields:
        half = np.abs(one.fields["domain"].reshape(-1, 3, 3)[:, :, 2]).sum(axis=1)
    else:
        half = one.fields["half_size"].reshape(len(one.ids), -1)[:, -1]
    return (one.fields["position"][:, 2] - half).min()


def hangs(domain, particles, top, ranks=1):
    """The end is where it must be, the bar rests, and gravity has done its work."""
    gravity, sag, work = hanging(top)
    name = f"{domain}_{particles}_{top:g}_{ranks}"
    run(bar(name, domain, particles, gravity, 1.8 * sag + 0.3), ranks)
    rows = energy(name)
    check(
        f"{name}: way of the end over the exact one, less 1",
        (-1 - lowest(snapshots(name)[-1])) / sag - 1,
        0.01,
    )
    check(f"{name}: work of gravity over the exact one, less 1", rows["external_work"][-1] / work - 1, 0.01)
    check(f"{name}: kinetic energy over the work", rows["kinetic"][-1] / work, 1e-12)
    check(f"{name}: balance of energy", rows["balance_error"][-1], 0.002)
    return name


def cubes():
    """One particle per cell that cannot be split: the run says so, and ends where neighbours are apart. Eight
    are right."""
    log = run(bar("cubes_1", "fixed", 1, 40.0, 1.0, end=1), 1, allowed=(3,))
    require("cubes: a word on tension", log.count("fixed domains of one a cell separate") >= 1)
    require(
        "cubes: a fault that says what to take",
        "the body has separated" in log and "particles_per_cell=8" in log,
    )
    top = 1.0 + 40 * DENSITY / (BULK + 4 / 3 * SHEAR)
    for _ in range(20):
        top -= (stress(top) - 40 * DENSITY) / (BULK + 4 / 3 * SHEAR)
    log = run(bar("cubes_8", "fixed", 8, 40.0, 1.0), 1)
    require("eight cubes: nothing to say", "range  " not in log)
    check(
        "eight cubes: work of gravity over the exact one, less 1",
        energy("cubes_8")["external_work"][-1] / hanging(top)[2] - 1,
        0.01,
    )
    for domain in ("stretch", "corners"):
        hangs(domain, 1, top)


def beam(domain, end):
    """AMPLE's beam under its own weight: the fastest particle comes to rest, not only the nodes."""
    name = f"beam_{domain}"
    run(
        f"&scene title='beam', end_time={end} /\n&grid lower=0,0,-4.5, upper=5.5,0.25,1.5, cell_size=0.25,\n"
        "boundary='fixed','free','symmetry','symmetry','free','free' /\n"
        f"&time domain='{domain}' /\n&material name='rubber', model='elastic', density=1000, young=12e6, "
        "poisson=0.2 /\n"
        "&body material='rubber', shape='box', lower=0,0,0, upper=5,0.25,1 /\n&gravity acceleration=0,0,-80 "
        "/\n"
        f"&damping kind='viscous', coefficient=9 /\n&output directory='{name}', every=1, history_every=0.1 "
        "/\n",
        1,
    )
    rows = energy(name)
    check(f"{name}: kinetic over strain energy", rows["kinetic"][-1] / rows["strain"][-1], 1e-6)
    speeds = [np.linalg.norm(one.fields["velocity"], axis=1).max() for one in snapshots(name)[1:]]
    print(
        f"   {name}: largest speed of a particle after each second / m/s:",
        *(f"{speed:.2g}" for speed in speeds),
    )
    check(f"{name}: largest speed of a particle at the end, m/s", speeds[-1], 0.02)
    require(f"{name}: it falls", all(after < before for before, after in zip(speeds, speeds[1:])))


if sys.argv[1:] == ["long"]:
    for domain in ("stretch", "corners"):
        for particles in (1, 8, 27):
            for top in (2, 3, 4):
                hangs(domain, particles, top)
    for domain in ("fixed", "stretch", "corners"):
        beam(domain, 4)
else:
    for domain in ("stretch", "corners"):
        hangs(domain, 8, 2)
        hangs(domain, 8, 3)
        hangs(domain, 1, 2)
    same_bits("corners_8_2_1", hangs("corners", 8, 2, ranks=2))
    cubes()
    beam("corners", 3)
finish()
