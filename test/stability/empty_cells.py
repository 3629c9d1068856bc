"""Nodes with next to no mass: corners that just reach an empty cell, bodies anywhere on the grid."""

import math

import numpy as np

from hard_case import hard_case

YOUNG, DENSITY, POISSON = 1e6, 1000.0, 0.3


def wave_speed(poisson):
    """m/s"""
    return math.sqrt(YOUNG / DENSITY * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson))


WAVE = wave_speed(POISSON)
CELL, EDGE, PITCH = 0.1, 4, 8  # m, cells a block, cells from block to block
IMPACT = 0.005 * WAVE  # the two halves of a block meet at twice this speed


def blocks(offsets, speed, steps, per_cell=8, domain="fixed", transfer="affine", poisson=POISSON):
    """Two halves of a block that meet, at each of the offsets (cells) from a node, all in flight along the
    diagonal at a speed."""
    count = math.ceil(len(offsets) ** 0.5)
    end = steps * 0.35 * CELL / (wave_speed(poisson) + 1.8 * speed)
    flown = math.ceil(speed * end / CELL) + 1
    text = [
        f"""&scene title='blocks anywhere on the grid', end_time={end!r} /
&grid lower=0,0,0, upper={(count * PITCH + flown) * CELL:.6f},{(count * PITCH + flown) * CELL:.6f},{(PITCH + flown) * CELL:.6f},
      cell_size={CELL} /
&time domain='{domain}', transfer='{transfer}' /
&material name='rubber', model='neo_hookean', density={DENSITY}, young={YOUNG}, poisson={poisson} /"""
    ]
    for n, offset in enumerate(offsets):
        low = (np.array([n % count * PITCH, n // count * PITCH, 0]) + 2 + np.array(offset)) * CELL
        middle, high = low + [EDGE / 2 * CELL, 0, 0], low + EDGE * CELL
        for one, two, sign in ((low, [middle[0], high[1], high[2]], 1), (middle, high, -1)):
            corners = [",".join(f"{x:.12g}" for x in at) for at in (one, two)]
            text.append(
                f"&body material='rubber', shape='box', lower={corners[0]}, upper={corners[1]}, "
                f"particles_per_cell={per_cell}, velocity={speed + sign * IMPACT!r},{speed!r},{speed!r} /"
            )
    text.append(f"&output directory='OUT', every={end / 40!r}, history_every={end / 200!r} /")
    return "\n".join(text) + "\n"


def inner_energy(outcome, speed):
    """Time, and energy about the flight, J."""
    rows = outcome.energy
    return rows["time"], rows["kinetic"] - 0.5 * rows["mass"] * 3 * speed**2 + rows["strain"]


def excited(outcome, speed, pairs):
    """Time, energy about the flight over the largest of the first quarter; largest speed of a particle about
    the flight, over that of the impact, of each pair of bodies."""
    time, inner = inner_energy(outcome, speed)
    fastest = np.zeros(pairs)
    for one in outcome.snapshots():
        about = np.linalg.norm(one["velocity"] - speed, axis=1) / IMPACT
        pair = (one["body"].ravel().astype(int) - 1) // 2
        np.maximum.at(fastest, pair, about)
    return time, inner / inner[time < time[-1] / 4].max(), fastest


def grown(time, energy):
    """Largest energy of the last half of a run over that of the first quarter. (Kinetic and strain energy
    stand half a step apart, so that their sum swings by half the step times the frequency, much in the waves
    of a few cells that an impact makes.)"""
    return energy[time > time[-1] / 2].max()


# By momentum, a free corner that a wave reaches moves at most at twice the speed behind it along each axis: 2
# sqrt(3) = 3.5, from
# Poisson's ratio a little more. What grows without bound passes 5 at once.
FASTEST = 5.0


@hard_case("empty_cell", short=True)
def empty_cell(bench):
    """A block whose corner particles reach into an empty cell with 1e-6 of their volume (a hundredth of their
    edge along each axis), and with 1e-3, 1e-9 and 1e-12 of it, flying at 0 to 0.2 of the wave speed."""
    steps = bench.pick(1000, 200)
    shown = {}
    # A particle's edge is half a cell; the face stands that share beyond the node.
    offsets = [[0.5 * share - EDGE % 1] * 3 for share in (1e-1, 1e-2, 1e-3, 1e-4)]
    for per_cell in bench.pick((1, 8, 27), (8,)):
        for speed in bench.pick((0.0, 0.02, 0.2), (0.02,)):
            name = f"{per_cell} a cell, flight at {speed} of the wave speed"
            out = bench.run(f"n{per_cell}_v{speed}", blocks(offsets, speed * WAVE, steps, per_cell))
            time, energy, fastest = excited(out, speed * WAVE, len(offsets))
            shown[name] = time, energy
            bench.at_most(f"{name}: largest energy later over that at first", grown(time, energy), 1.01)
            bench.at_most(f"{name}: fastest particle over the impact", fastest, FASTEST)

    def draw(axes):
        for name, (time, energy) in shown.items():
            axes.plot(time / time[-1] * steps, energy, lw=0.8, label=name)
        axes.set(xlabel="steps", ylabel="energy about the flight over the first")

    bench.picture(draw)


@hard_case("jitter")
def jitter(bench):
    """100 blocks, each at a random place within a cell."""
    offsets = np.random.default_rng(7).random((bench.pick(100, 9), 3))
    steps = bench.pick(600, 100)
    found = {}
    for speed in (0.0, 0.05):
        out = bench.run(f"v{speed}", blocks(offsets, speed * WAVE, steps))
        time, energy, fastest = excited(out, speed * WAVE, len(offsets))
        found[speed] = fastest
        bench.at_most(
            f"flight at {speed} of the wave speed: largest energy later over that at first",
            grown(time, energy),
            1.01,
        )
        bench.at_most(
            f"flight at {speed} of the wave speed: fastest particle over the impact", fastest, FASTEST
        )

    def draw(axes):
        for speed, fastest in found.items():
            axes.hist(fastest, bins=20, histtype="step", label=f"flight at {speed} of the wave speed")
        axes.set(xlabel="fastest particle over the speed of the impact", ylabel="blocks")

    bench.picture(draw)
