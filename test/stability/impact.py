"""Impact: Taylor bars, spheres that collide."""
import math

import numpy as np

from hard_case import hard_case
from contact import shipped


@hard_case("taylor")
def taylor(bench):
    """The shipped copper bar, three cells a radius, at 100 to 400 m/s. No experiment at all of these speeds is compared with: the bar must
    come to rest, keep its balance of energy to 3 %, be shorter the faster it was, and at 190 m/s as long as in the experiment (16.2 mm:
    Johnson and Holmquist 1988) within the 10 % of test/verification/taylor.py."""
    cell = 3.81e-3 / 3
    lengths = {}
    for speed in bench.pick((100, 190, 300, 400), (190,)):
        text = shipped("taylor", cell_size=repr(cell), every=40e-6).replace("-190", f"-{speed}")
        text = text.replace("upper=9.144e-3,9.144e-3,27.432e-3", f"upper={24 * cell!r},{24 * cell!r},{22 * cell!r}")
        out = bench.run(f"at_{speed}", text)
        rows, last = out.energy, out.snapshots()[-1]
        lengths[speed] = (last["position"][:, 2].max() + cell / 4) * 1e3
        bench.at_most(f"{speed} m/s: balance of energy, relative", abs(rows["balance_error"]), 0.03)
        bench.at_most(f"{speed} m/s: kinetic energy at the end over the first", rows["kinetic"][-1] / rows["kinetic"][0], 0.02)
        if speed == 190:
            bench.at_most("190 m/s: length off the experiment, relative", abs(lengths[speed] / 16.2 - 1), 0.1)
    found = list(lengths.values())
    bench.at_most("length at a speed over that at the last lower one", max([b / a for a, b in zip(found, found[1:])] or [0.0]), 1.0)

    def draw(axes):
        axes.plot(list(lengths), found, "o-", label="run")
        axes.plot([190], [16.2], "k*", label="experiment")
        axes.set(xlabel="speed [m/s]", ylabel="length at the end [mm]")
    bench.picture(draw)


@hard_case("spheres", short=True)
def spheres(bench):
    """Two equal elastic spheres, head on at a hundredth of the wave speed each. Momentum is exact; they part again, with nine tenths of the
    energy of their motion (waves that stay behind take a few per cent at this speed); they feel each other at most two cells ahead, where
    their domains first share a node, and noticeably (a hundredth of their momentum) at most one cell ahead. Plain transfer beside it."""
    cell, radius = 0.1, bench.pick(0.5, 0.4)
    young, density, poisson = 1e6, 1000.0, 0.3
    wave = math.sqrt(young / density * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson))
    speed, gap = 0.01 * wave, 0.3
    end = (2 * gap + 0.1) / speed + 30 * radius / wave
    shown = {}
    for transfer in bench.pick(("affine", "plain"), ("affine",)):
        out = bench.run(transfer, f"""&scene title='two spheres', end_time={end!r} /
&grid lower=-2,-0.8,-0.8, upper=2,0.8,0.8, cell_size={cell} /
&time transfer='{transfer}', domain='fixed' /
&material name='rubber', model='neo_hookean', density={density}, young={young}, poisson={poisson} /
&body material='rubber', shape='sphere', center={-radius - gap},0.01,0.02, radius={radius}, velocity={speed!r},0,0 /
&body material='rubber', shape='sphere', center={radius + gap},0.01,0.02, radius={radius}, velocity={-speed!r},0,0 /
&output directory='OUT', every={end / 200!r}, history_every={end / 400!r} /
""")
        rows, seen = out.energy, out.snapshots()
        ways = []
        for one in seen:
            body = one["body"].ravel()
            x, v = one["position"][:, 0], one["velocity"][:, 0]
            ways.append((one.time, v[body == 1].mean() / speed, (x[body == 2].min() - x[body == 1].max() - cell / 2) / cell))
        time, mean, apart = np.array(ways).T
        shown[transfer] = apart, mean
        feels = int(np.argmax(mean < 0.99))
        first = int(np.argmax(mean < 1 - 1e-9))
        momentum = max(abs(rows[f"momentum_{axis}"] - rows[f"momentum_{axis}"][0]).max() for axis in "xyz")
        mass = rows["mass"][0] / 2
        bench.at_most(f"{transfer}: change of momentum over a sphere's", momentum / (mass * speed), 1e-12)
        bench.at_most(f"{transfer}: energy over the first", (rows["kinetic"] + rows["strain"]) / rows["kinetic"][0], 1.01)
        bench.at_least(f"{transfer}: energy of the spheres' motion recovered", mean[-1] ** 2 if mean[-1] < 0 else 0.0, 0.9)
        bench.at_most(f"{transfer}: gap at which they first feel each other [cells]", apart[first], 2.0)
        bench.at_most(f"{transfer}: gap at a hundredth of their momentum [cells]", apart[feels], 1.0, known=True)

    def draw(axes):
        for transfer, (apart, mean) in shown.items():
            axes.plot(apart, mean, ".-", ms=3, label=transfer)
        axes.set(xlabel="gap between the spheres [cells]", ylabel="speed of the left one over the first")
    bench.picture(draw)
