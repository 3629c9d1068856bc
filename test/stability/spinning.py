"""Bodies that turn."""
import math

import numpy as np

from hard_case import hard_case

YOUNG, DENSITY, POISSON = 1e6, 1000.0, 0.3
WAVE = math.sqrt(YOUNG / DENSITY * (1 - POISSON) / (1 + POISSON) / (1 - 2 * POISSON))


def spin(turns, domain="fixed", transfer="affine", rim=0.05):
    """A block of 8 x 6 x 4 cells that turns about a skew axis; the rim runs at a share of the wave speed."""
    half = 0.4, 0.3, 0.2
    rate = rim * WAVE / math.hypot(*half)
    axis = 0.6 * rate, 0.0, 0.8 * rate
    end = turns * 2 * math.pi / rate
    return f"""&scene title='spin', end_time={end!r} /
&grid lower=-0.8,-0.8,-0.8, upper=0.8,0.8,0.8, cell_size=0.1 /
&time transfer='{transfer}', domain='{domain}' /
&material name='rubber', model='neo_hookean', density={DENSITY}, young={YOUNG}, poisson={POISSON} /
&body material='rubber', shape='box', lower=-0.4,-0.3,-0.2, upper=0.4,0.3,0.2, angular_velocity={axis[0]!r},0,{axis[2]!r} /
&output directory='OUT', every={end / 4!r}, history_every={end / 400!r} /
"""


def change(outcome):
    """Largest change of angular momentum and of energy, relative, and of how far the farthest particle is from the middle."""
    rows = outcome.energy
    angular = np.stack([rows[f"angular_momentum_{axis}"] for axis in "xyz"], axis=1)
    energy = rows["kinetic"] + rows["strain"]
    seen = outcome.snapshots()
    reach = [np.linalg.norm(one["position"] - one["position"].mean(axis=0), axis=1).max() for one in seen]
    return (np.linalg.norm(angular - angular[0], axis=1).max() / np.linalg.norm(angular[0]), np.abs(energy / energy[0] - 1).max(),
            np.abs(np.array(reach) / reach[0] - 1).max(), energy.max() / energy[0])


@hard_case("spin", short=True)
def spin_case(bench):
    """Ten turns with each kind of domain. A tenth of the angular momentum in ten turns is 1 % a turn: what a tool or a thrown body that
    turns once or twice would not notice. Energy must not grow beyond the half step between its two parts."""
    turns = bench.pick(10, 2)
    curves = {}
    for domain in ("fixed", "stretch", "corners"):
        out = bench.run(domain, spin(turns, domain))
        angular, energy, reach, largest = change(out)
        curves[domain] = out.energy
        bench.at_most(f"{domain}: change of angular momentum, relative", angular, 0.1)
        bench.at_most(f"{domain}: change of energy, relative", energy, 0.1)
        bench.at_most(f"{domain}: largest energy over the first", largest, 1.01)
        bench.at_most(f"{domain}: change of the farthest particle's distance, relative", reach, 0.02)
    out = bench.run("plain", spin(turns, transfer="plain"))
    curves["plain transfer"] = out.energy
    bench.at_most("plain transfer: change of angular momentum, relative", change(out)[0], 0.1, control=True)

    def draw(axes):
        for name, rows in curves.items():
            length = np.sqrt(sum(rows[f"angular_momentum_{axis}"] ** 2 for axis in "xyz"))
            axes.plot(rows["time"] / rows["time"][-1] * turns, length / length[0], label=name)
        axes.set(xlabel="turns", ylabel="angular momentum over the first")
    bench.picture(draw)
