"""Quasi-static steps on nested levels (theory.md, eq. static-levels). usage: levels.py short|long (in an empty
directory; GIMP3D is the program)"""

import sys

import numpy as np

from static_scenes import (
    check,
    counts,
    finish,
    first_particles,
    last_particles,
    newton_by_step,
    require,
    run,
    tool,
)

BOX = "&level lower=0,0,3, upper=5,5,9 /"


def patch():
    """A block under a pressure of a tenth of its modulus, with a level around a part of it: one stress
    everywhere, though particles cross cells and leave the level. (No particle gets wider: at the edge those
    of the coarser level are as wide as weights of the finer one may be; with a Poisson's ratio they are too
    wide, and the stress is not one.)"""
    spreads = []
    for poisson in (0, 0.3):
        run(
            "&scene title='patch', end_time=1 /\n&grid lower=0,0,0, upper=10,10,10, cell_size=1, "
            "boundary='symmetry','free','symmetry','free','roller','free' /\n"
            f"&material name='soft', model='neo_hookean', density=1, young=1, poisson={poisson} /\n"
            "&body material='soft', shape='box', lower=0,0,0, upper=4.5,4.5,5.5 /\n"
            "&level lower=0,0,3, upper=4,6,10 /\n"
            "&pressure lower=0,0,5.5, upper=4.5,4.5,5.5, times=0,1, values=0,0.1 /\n"
            "&time domain='stretch' /\n&quasi_static step=0.2, max_step=0.2, tolerance=1e-10 /\n"
            f"&output directory='patch_{poisson}' /\n",
            1,
        )
        particles = last_particles(f"patch_{poisson}")
        stress = particles["stress"]
        require(f"patch, {poisson}: both levels have particles", len(np.unique(particles["level"])) == 2)
        spreads.append(np.ptp(stress, axis=0) / np.abs(stress).max())
    check("patch: spread of the stress, relative", spreads[0], 1e-8)
    check("patch, wider particles: spread of the stress, relative", spreads[1], 5e-3)
    require("patch, wider particles: the stress is not one", spreads[1].max() > 1e-6)


def weight():
    """A slab under its weight with a level in its upper half: the stress of a column, within what a laboratory
    had on 4 cells; and as much of it as the weight and where it is ask for, which hold each other at rest."""
    for name, level in (("plain", ""), ("level", "&level lower=0,0,6, upper=4,4,14 /\n")):
        run(
            "&scene title='weight', end_time=1 /\n&grid lower=0,0,0, upper=4,4,14, cell_size=1, "
            "boundary='symmetry','symmetry','symmetry','symmetry','roller','free' /\n"
            "&material name='soft', model='neo_hookean', density=1, young=1, poisson=0 /\n"
            f"&body material='soft', shape='box', lower=0,0,0, upper=4,4,12 /\n{level}"
            "&gravity acceleration=0,0,-0.01 /\n&time domain='stretch' /\n"
            f"&quasi_static step=0.2, max_step=0.2, ramp=0.4 /\n&output directory='weight_{name}' /\n",
            1,
        )
        first, last = first_particles(f"weight_{name}"), last_particles(f"weight_{name}")
        off = np.abs(last["stress"][:, 2] + 0.01 * (12 - first["position"][:, 2])) * first["volume"]
        error = off.sum() / (0.01 * 12 * first["volume"].sum())
        check(f"weight, {name}: mean error of the stress, relative", error, 2.2e-2)
        asked = -0.01 * (last["mass"] * last["position"][:, 2]).sum()
        check(
            f"weight, {name}: sum of the stress against that of the weight, relative",
            (last["volume"] * last["stress"][:, 2]).sum() / asked - 1,
            1e-4,
        )


def ball(name, cell, level):
    return (
        f"&scene title='{name}', end_time=1 /\n&grid lower=0,0,0, upper=11,11,9, cell_size={cell}, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        "&material name='soft', model='neo_hookean', density=1, young=1, poisson=0.3 /\n"
        f"&body material='soft', shape='box', lower=0,0,0, upper=8,8,7 /\n{level}\n"
        "&tool name='ball', shape='sphere', radius=5, tip=0,0,7, times=0, speeds=0.5 /\n"
        f"&time domain='stretch' /\n&quasi_static step=0.25, max_step=0.25 /\n&output directory='{name}' /\n"
    )


def ranks():
    """A ball on two levels: the same load on 1, 2 and 4 ranks, to the tolerance."""
    loads = {}
    for n in (1, 2, 4):
        log = run(ball(f"ball_{n}", 1, BOX), n)
        loads[n] = tool(f"ball_{n}", "ball")["load_z"]
        check(f"ball on two levels, {n} ranks: Newton iterations a step", counts(log)[1], 8)
    # the compliance below a cell doubles them, as its points open and close; products of a step are fewer
    log = run(ball("ball_plain", 1, BOX) + "&contact subcell=0 /\n", 1)
    check("ball on two levels, without the compliance below a cell: Newton iterations", counts(log)[1], 4)
    for n in (2, 4):
        check(f"ball: load on {n} ranks against 1, relative", (loads[n] - loads[1]) / loads[1].max(), 1e-5)
    return loads[1][-1]


def against_fine():
    """The load on two levels is that of a grid as fine everywhere; a coarse grid's is not, without the
    compliance below a cell (with it the coarse grid is within 0.5 %)."""
    two = ranks()
    loads = {}
    for name, cell, more in (("coarse", 1, "&contact subcell=0 /\n"), ("fine", 0.5, "")):
        run(ball(name, cell, "") + more, 2)
        loads[name] = tool(name, "ball")["load_z"][-1]
    check("ball: load on two levels against a fine grid, relative", two / loads["fine"] - 1, 1e-3)
    require("ball: a coarse grid's load is further off", abs(loads["coarse"] / loads["fine"] - 1) > 5e-3)


def following():
    """A ball ploughs through soft metal, and the level goes with it: particles split ahead. Loads are those of
    a level that is there, as long as what flows ahead of the ball (its contact has a radius of 1.5) stays in
    the level that follows, to 4.4 cells before its centre at least. A level that ends 2.4 cells before it
    takes in metal that has flowed on coarse cells, and its loads keep that."""
    for name, last, more in (
        ("with", 12, ", follow='ball'"),
        ("near", 10, ", follow='ball'"),
        ("fixed", 14, ""),
    ):
        box = f"4,0,3, upper={last},4,8"
        log = run(
            "&scene title='plough', end_time=4 /\n&grid lower=0,0,0, upper=18,6,8, cell_size=1, "
            "boundary='free','free','symmetry','free','fixed','free' /\n"
            "&material name='soft', model='j2', density=1, young=1, poisson=0.3, yield_stress=0.01, "
            "hardening_modulus=0.02 /\n&body material='soft', shape='box', lower=2,0,0, upper=16,4,5 /\n"
            f"&level lower={box}{more} /\n"
            "&tool name='ball', shape='sphere', radius=3, tip=7,0,5, times=0,1,1.001, speeds=0.4,0.4,0 /\n"
            "&motion tool='ball', kind='slide', axis=1,0,0, times=0,1,1.001, speeds=0,0,0.8 /\n"
            "&time domain='stretch' /\n&quasi_static step=0.25, max_step=0.25, iterations=.true. /\n"
            f"&output directory='plough_{name}' /\n",
            2,
        )
        require(f"plough, {name}: no step is halved", counts(log)[4] == 0)
        check(f"plough, {name}: Newton iterations of a step", np.array(newton_by_step(log)), 6)
    means = {}
    for name in ("with", "near", "fixed"):
        history = tool(f"plough_{name}", "ball")
        late = history["time"] > 2
        means[name] = np.array([history[f"load_{axis}"][late].mean() for axis in "xz"])
    check(
        "plough: drag and load on a level that follows against one that is there, relative",
        means["with"] / means["fixed"] - 1,
        1e-3,
    )
    off = means["near"] / means["fixed"] - 1
    print(f"plough: the same of a level that ends 2.4 cells ahead: {off}")
    require("plough: a level that ends where metal flows is further off", off.min() > 3e-3)


if __name__ == "__main__":
    if sys.argv[1] == "long":
        against_fine()
        following()
    else:
        patch()
        weight()
        ranks()
    finish()
