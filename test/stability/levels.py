"""Edges of levels: bodies thrown through them, plastic flow through them, a level that follows a fast
tool."""

import math

import numpy as np

from hard_case import ROOT, hard_case
from contact import noise

YOUNG, DENSITY, POISSON = 1e6, 1000.0, 0.3
WAVE = math.sqrt(YOUNG / DENSITY * (1 - POISSON) / (1 + POISSON) / (1 - 2 * POISSON))


@hard_case("thrown", short=True)
def thrown(bench):
    """A block that spins flies through three levels and out again, beside the same on one level. Mass and
    momentum exact; energy does not grow, and less than 2 % more of it is lost than on one level; angular
    momentum drifts by less than 10 %."""
    flight, rate = 0.05 * WAVE, 0.03 * WAVE / 0.3
    end = bench.pick(3.2, 1.0) / flight
    kept = {}
    shown = {}
    for name, levels in (
        ("one level", ""),
        (
            "three levels",
            "&level lower=0.8,0.2,0.2, upper=3.4,1.4,1.4 /\n&level lower=1.4,0.4,0.4, upper=2.8,1.2,1.2 /\n",
        ),
    ):
        out = bench.run(
            name.replace(" ", "_"),
            f"""&scene title='thrown', end_time={end!r} /
&grid lower=0,0,0, upper=4.4,1.6,1.6, cell_size=0.1 /
{levels}&time domain='fixed' /
&material name='rubber', model='neo_hookean', density={DENSITY}, young={YOUNG}, poisson={POISSON} /
&body material='rubber', shape='box', lower=0.25,0.63,0.61, upper=0.65,0.93,0.91, velocity={flight!r},0,0,
      angular_velocity={0.6 * rate!r},{0.8 * rate!r},0 /
&output directory='OUT', every={end / 3!r}, history_every={end / 300!r} /
""",
        )
        rows = out.energy
        energy = (rows["kinetic"] + rows["strain"]) / rows["kinetic"][0]
        shown[name] = rows["time"], energy
        kept[name] = energy[-1]
        mass, momentum = rows["mass"], np.stack([rows[f"momentum_{axis}"] for axis in "xyz"], axis=1)
        angular = np.stack([rows[f"angular_momentum_{axis}"] for axis in "xyz"], axis=1)
        # About the body's own middle: the flight's share grows with the way, and is exact where momentum is.
        inner = math.hypot(*(np.array([0.6, 0.8]) * rate * mass[0] * 0.3**2 / 6))
        bench.at_most(f"{name}: change of mass, relative", abs(mass / mass[0] - 1), 1e-13)
        bench.at_most(
            f"{name}: change of momentum, relative",
            abs(momentum - momentum[0]) / np.linalg.norm(momentum[0]),
            1e-12,
        )
        bench.at_most(f"{name}: largest energy over the first", energy, 1.01)
        bench.at_most(
            f"{name}: change of angular momentum over that of the spin",
            np.linalg.norm(angular - angular[0], axis=1) / inner,
            0.1,
        )
    bench.at_most(
        "energy lost on three levels more than on one, relative",
        kept["one level"] - kept["three levels"],
        0.02,
    )

    def draw(axes):
        for name, (time, energy) in shown.items():
            axes.plot(time / time[-1], energy, lw=0.8, label=name)
        axes.set(xlabel="share of the flight", ylabel="energy over the first")

    bench.picture(draw)


@hard_case("flow_through_edge")
def flow_through_edge(bench):
    """A plastic bar hits a wall (a symmetry side) at 20 m/s and comes to rest; its foot stands in a finer
    level, and material flows through the level's edge. Length and foot as on a grid that is fine everywhere,
    within 2 %; momentum, balance and mass as ever."""
    found = {}
    for name, cell, level in (
        ("fine", 0.25, ""),
        ("level", 0.5, "&level lower=0,0,0, upper=6,6,4 /"),
        ("coarse", 0.5, ""),
    ):
        out = bench.run(
            name,
            f"""&scene title='flow through an edge', end_time=0.3 /
&grid lower=0,0,0, upper=6,6,12, cell_size={cell}, boundary='symmetry','free','symmetry','free','symmetry','free' /
{level}
&time domain='fixed' /
&material name='m', model='j2', density=1000, young=1e8, poisson=0.3, yield_stress=5e5, hardening_modulus=5e5 /
&body material='m', shape='box', lower=0,0,0, upper=2,2,10, velocity=0,0,-20, particles_per_cell=8 /
&anti_locking /
&output directory='OUT', every=0.15, history_every=1e-3 /
""",
            allowed=(0,),
        )
        last, rows = out.snapshots()[-1], out.energy
        edge = cell / 4
        bench.at_most(
            f"{name}: kinetic energy at the end over the first",
            rows["kinetic"][-1] / rows["kinetic"][0],
            0.02,
        )
        found[name] = (
            last["position"][:, 2].max() + edge,
            last["position"][:, 0][last["position"][:, 2] < 0.5].max() + edge,
        )
        bench.at_most(f"{name}: balance of energy, relative", abs(rows["balance_error"]), 0.03)
        bench.at_most(f"{name}: change of mass, relative", abs(rows["mass"] / rows["mass"][0] - 1), 1e-13)
        if name == "fine":
            shape = {}
        shape[name] = last["position"]
    for n, what in enumerate(("length", "foot")):
        bench.at_most(
            f"{what} with a level off that on a fine grid, relative",
            abs(found["level"][n] / found["fine"][n] - 1),
            0.02,
        )

    def draw(axes):
        for name, place in shape.items():
            near = place[:, 1] < 0.5
            axes.plot(place[near, 0] * (-1 if name == "level" else 1), place[near, 2], ".", ms=1, label=name)
        axes.axhline(4, color="k", lw=0.5)
        axes.set(xlabel="x [m] (level: mirrored)", ylabel="z [m]", aspect="equal")

    bench.picture(draw)


@hard_case("follow")
def follow(bench):
    """The scene `moving` of test/verification/nested_scenes.py, its level following the tool, at its speed
    and at three times that (0.07 of the wave speed): load within 3 % of the grid that is fine everywhere over
    the second half of the depth; noise below 2 %."""
    text = (ROOT / "test/verification/nested_scenes.py").read_text()
    scene = text[text.index('MOVING = """') + len('MOVING = """') :]
    scene = scene[: scene.index('"""')].replace("directory='out'", "directory='OUT'")
    fine = "".join(line + "\n" for line in scene.splitlines() if not line.startswith("&level")).replace(
        "2.56e-6", "1.28e-6"
    )
    follows = scene.replace("38.4e-6 /\n&mat", "38.4e-6, follow='sphere' /\n&mat")
    shown = {}
    for speed, end in ((150.8, "2.2e-8"), (452.4, "8.3e-9")):
        runs = {}
        for name, text in (("follows", follows), ("fine", fine)):
            rows = bench.run(
                f"{name}_{speed:.0f}", text.replace("150.8", str(speed)).replace("2.2e-8", end)
            ).tool("sphere")
            runs[name] = rows["depth"] * 1e6, rows["load_z"] * 1e3
        depth = np.linspace(0.5, 0.98, 100) * min(run[0][-1] for run in runs.values())
        loads = {name: np.interp(depth, *run) for name, run in runs.items()}
        shown[speed] = runs
        bench.at_most(
            f"{speed:.0f} m/s: load off the fine grid, relative",
            np.mean(np.abs(loads["follows"] / loads["fine"] - 1)),
            0.03,
        )
        bench.at_most(f"{speed:.0f} m/s: load noise, relative", noise(*runs["follows"]), 0.02)

    def draw(axes):
        for speed, runs in shown.items():
            for name, run in runs.items():
                axes.plot(*run, lw=0.8, label=f"{speed:.0f} m/s, {name}")
        axes.set(xlabel="depth [um]", ylabel="load [mN]")

    bench.picture(draw)
