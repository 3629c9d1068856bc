"""Bodies under load: squeezed to a tenth, nearly incompressible, stiff over soft, at the edge of the time step, for very long."""
import math

import numpy as np

from hard_case import hard_case
from empty_cells import CELL, WAVE, blocks, excited, grown


def squeezed_load(stretch, young, poisson):
    """Force over first area of a free neo-Hookean cube squeezed to `stretch` of its height: the lateral stretch that leaves its sides free
    of stress, by bisection (theory.md, eq. neo-hookean)."""
    shear, bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))

    def stresses(across):
        volume = stretch * across**2
        mean = (stretch**2 + 2 * across**2) / 3
        factor = shear * volume ** (-5 / 3)
        return factor * (across**2 - mean) + bulk * (volume - 1), factor * (stretch**2 - mean) + bulk * (volume - 1)
    low, high = 0.5, 10.0
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if stresses(middle)[0] > 0 else (middle, high)
    return -stresses(low)[1] * low**2


@hard_case("squeezed")
def squeezed(bench):
    """A quarter of a neo-Hookean block, 4 x 4 x 8 cells (short: 2 x 2 x 4), under a frictionless flat tool to a tenth of its height, slowly: each second takes
    the same share of the height that is left. The exact load is that of free lateral expansion. A tool's load is read to a few per
    cent: the bar is 5 % down to half of the height and 10 % down to a tenth, where less than a cell is left. Poisson 0.49: with 0.3 this law has no
    stable state below 0.39 of the height (the least of its energy over the lateral stretch goes), so that the block must collapse there."""
    half, left = bench.pick(4, 2), 0.1
    height = 2.0 * half
    shown = {}
    for name, domain, poisson, deepest in (("fixed", "fixed", 0.49, 0.9), ("stretch", "stretch", 0.49, 0.9), ("corners", "corners", 0.49, 0.9),
                                           ("corners, Poisson 0.3", "corners", 0.3, 0.55)):
        young = 1e6
        wave = math.sqrt(young / 1000 * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson))
        rate = 0.006 * wave / height
        times = np.linspace(0, math.log(1 / left) / rate, 30)
        numbers = [",".join(f"{x:.8g}" for x in values) for values in (times, height * rate * np.exp(-rate * times))]
        out = bench.run(name.replace(", ", "_").replace(" ", "_"), f"""&scene title='squeezed', end_time={float(times[-1])!r} /
&grid lower=0,0,0, upper={5 * half},{5 * half},{2 * half + 2}, cell_size=1,
      boundary='symmetry','free','symmetry','free','symmetry','free' /
&time domain='{domain}' /
&material name='rubber', model='neo_hookean', density=1000, young={young}, poisson={poisson} /
&body material='rubber', shape='box', lower=0,0,0, upper={half},{half},{2 * half}, particles_per_cell=8 /
&tool name='flat', shape='flat', radius={10 * half}, tip=0,0,{2 * half}, times={numbers[0]},
      speeds={numbers[1]}, penetration_factor=0.5 /
&damping kind='viscous', coefficient={0.1 * wave / height!r} /
&anti_locking /
&output directory='OUT', history_every={float(times[-1]) / 2000!r} /
""", allowed=(0, 3))
        rows = out.tool("flat")
        share, load = rows["depth"] / height, rows["load_z"] / half**2 / young
        shown[name] = share, load
        bench.at_least(f"{name}: squeezed by this share of the height", share[-1], deepest - 0.002, known=deepest == 0.9)
        for at, bar in ((0.5, 0.05), (0.9, 0.1)):
            near = abs(share - at) < 0.01
            if at > deepest:
                continue
            exact = [squeezed_load(1 - d, 1.0, poisson) for d in share[near]]
            off = abs(np.mean(load[near]) / np.mean(exact) - 1) if near.any() else np.inf
            bench.at_most(f"{name}: load at {at:.0%} off the exact {squeezed_load(1 - at, 1.0, poisson):.3g} E, relative", off, bar,
                          known=name != "corners" or at > 0.5)

    def draw(axes):
        shares = np.linspace(0.01, 0.9, 90)
        axes.semilogy(shares, [squeezed_load(1 - s, 1.0, 0.49) for s in shares], "k", lw=0.8, label="exact, Poisson 0.49")
        for name, (share, load) in shown.items():
            axes.semilogy(share, np.maximum(load, 1e-3), lw=0.8, label=name)
        axes.set(xlabel="squeezed by this share", ylabel="load over first area and E", ylim=(1e-2, None))
    bench.picture(draw)


@hard_case("incompressible", short=True)
def incompressible(bench):
    """Poisson 0.4999: two halves of a block meet and ring in flight, with anti-locking (Young's modulus 1 MPa, flight at 5 m/s, as in
    test/verification/locking.py). Energy must not grow, at rest on the grid or in flight."""
    poisson, speed = 0.4999, 5.0
    wave = math.sqrt(1e3 * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson))
    steps = bench.pick(6000, 600)
    shown = {}
    for name, effect in (("without anti-locking", ""), ("with anti-locking", "&anti_locking /")):
        end = steps * 0.35 * 0.1 / (wave + speed)
        cells = math.ceil(10 * (2 + speed * end))
        out = bench.run(name.split()[0], f"""&scene title='two halves that ring', end_time={end!r} /
&grid lower=0,0,0, upper={cells / 10},{cells / 10},1, cell_size=0.1 /
&material name='rubber', model='elastic', density=1000, young=1e6, poisson={poisson} /
&body material='rubber', shape='box', lower=0.3,0.3,0.3, upper=0.7,0.7,0.7, velocity={speed + 0.5},{speed / 2},0 /
&body material='rubber', shape='box', lower=0.7,0.3,0.3, upper=1.1,0.7,0.7, velocity={speed - 0.5},{speed / 2},0 /
{effect}
&output directory='OUT', history_every={end / 200!r} /
""")
        rows = out.energy
        energy = rows["kinetic"] - 64 * (speed**2 + (speed / 2) ** 2) + rows["strain"]
        energy /= energy[0]
        shown[name] = np.linspace(0, steps, energy.size), energy
        bench.at_most(f"{name}: largest energy over the first", energy, 1.01)
        momentum = max(np.abs(rows[f"momentum_{axis}"] - rows[f"momentum_{axis}"][0]).max() for axis in "xyz")
        bench.at_most(f"{name}: change of momentum, relative", momentum / (128 * speed), 1e-12)

    def draw(axes):
        for name, (step, energy) in shown.items():
            axes.plot(step, energy, lw=0.8, label=name)
        axes.set(xlabel="steps", ylabel="energy about the flight over the first")
    bench.picture(draw)


@hard_case("stiff_on_soft")
def stiff_on_soft(bench):
    """A stiff layer on one 10^4 times softer, equally thick, confined, Poisson 0, pressed slowly by 5 % of the soft one. Exactly, the stress
    is E ln(1 - strain) of the soft layer everywhere (theory.md, eq. elastic). Load within 2 %; mean stress of each layer of cells within
    5 %; no particle off by more than half of the stress."""
    shown = {}
    for cells in bench.pick((4, 8), (4,)):
        load, height, stress, means, top = stiff_column(bench, cells)
        shown[cells] = height / cells, stress
        bench.at_most(f"{cells} soft cells: load off the exact, relative", load, 0.02, known=True)
        bench.at_most(f"{cells} soft cells: mean stress of a layer of cells off the exact, relative", abs(means - 1), 0.05, known=True)
        bench.at_most(f"{cells} soft cells: stress of a particle off the exact, relative", abs(stress - 1), 0.5, known=True)

    def draw(axes):
        for cells, (height, stress) in shown.items():
            axes.plot(stress, height, ".", ms=4, label=f"{cells} soft cells")
        axes.axvline(1, color="k", lw=0.5)
        axes.axhline(0.95, color="r", lw=0.5)
        axes.set(xlabel="stress over the exact", ylabel="height over that of the soft layer")
    bench.picture(draw)


def stiff_column(bench, cells):
    """Load off the exact one; height (cells) and stress over the exact one of the particles; mean stress of the layers of cells; height."""
    soft, ratio, pressed = 1e6, 1e4, 0.05
    # The stiff layer on the soft spring swings at this rate; damped critically, pressed over 2 s, held for 1 s. Cells of 4/cells m.
    swing, cell = math.sqrt(soft / 4 / (1000 * 4)), 4 / cells
    speed = pressed * 4 / 1.8
    out = bench.run(f"column_{cells}", f"""&scene title='stiff on soft', end_time=3 /
&grid lower=0,0,0, upper={cell},{cell},10, cell_size={cell}, boundary='symmetry','symmetry','symmetry','symmetry','symmetry','free' /
&material name='soft', model='elastic', density=1000, young={soft}, poisson=0 /
&material name='stiff', model='elastic', density=1000, young={soft * ratio}, poisson=0 /
&body material='soft', shape='box', lower=0,0,0, upper={cell},{cell},4 /
&body material='stiff', shape='box', lower=0,0,4, upper={cell},{cell},8 /
&tool name='flat', shape='flat', radius=8, tip=0,0,8, times=0,0.2,1.8,2, speeds=0,{speed},{speed},0, penetration_factor=0.5 /
&damping kind='viscous', coefficient={2 * swing} /
&output directory='OUT', history_every=0.003 /
""")
    rows = out.tool("flat")
    depth = rows["depth"][-1]
    exact = -soft * math.log(1 - depth / (4 + 4 / ratio))
    last = out.snapshots()[-1]
    height, stress = last["position"][:, 2] / cell, -last["stress"][:, 2] / exact
    top = 2 * cells - depth / cell
    layer = np.minimum((height / top * 2 * cells).astype(int), 2 * cells - 1)
    means = np.array([stress[layer == n].mean() for n in range(2 * cells)])
    return abs(np.mean(rows["load_z"][rows["time"] > 2.9]) / cell**2 / exact - 1), height, stress, means, top


@hard_case("time_step", short=True)
def time_step(bench):
    """The largest safety that a scene may ask for, with each kind of domain and number of particles. A longer step, given by time_step, must
    be refused (status 2); test/verification/stability_limit finds where it would fail."""
    steps = bench.pick(1500, 200)
    offsets = [[0.5 * share] * 3 for share in (1e-3, 0.1, 0.4)]
    shown = {}
    for domain in ("fixed", "stretch", "corners"):
        for per_cell in (1, 8, 27):
            text = blocks(offsets, 0.02 * WAVE, steps, per_cell, domain)
            safety = 0.35 if per_cell == 27 else 0.4
            out = bench.run(f"{domain}_{per_cell}", text.replace("&time ", f"&time safety={safety}, "))
            time, energy, _ = excited(out, 0.02 * WAVE, len(offsets))
            shown[f"{domain}, {per_cell}"] = time, energy
            bench.at_most(f"{domain}, {per_cell} a cell, safety {safety}: largest energy later over that at first", grown(time, energy), 1.01)
    step = 0.41 * CELL / WAVE
    out = bench.run("too_long", blocks(offsets, 0.0, steps).replace("&time ", f"&time time_step={step!r}, "), allowed=(0, 2, 3))
    bench.at_most("a given step of 0.41 cells over the wave speed: exit status off 2", abs(out.status - 2), 0)

    def draw(axes):
        for name, (time, energy) in shown.items():
            axes.plot(time / time[-1] * steps, energy, lw=0.8, label=name)
        axes.set(xlabel="steps", ylabel="energy about the flight over the first")
    bench.picture(draw)


@hard_case("long")
def long(bench):
    """10^5 steps: a bar rings in its first mode, at rest on the grid and creeping through it, with and without a finer level in its middle.
    Energy must not grow from the first ten periods to the last; a hundredth is allowed for where peaks fall between steps."""
    periods = bench.pick(900, 30)
    for name, speed, levels in (("one level, at rest", 0.0, 1), ("one level, creeping", 0.001, 1), ("two levels, at rest", 0.0, 2)):
        share = 1 if levels == 1 else 3
        one = bench.measure("crossing", speed, 0, "fixed", periods // share, levels)
        bench.at_most(f"{name}: largest energy of the last period over the first", one["energy"], 1.01)
        bench.at_most(f"{name}: change of momentum, relative", one["momentum"], 1e-11)


@hard_case("cold_drift")
def cold_drift(bench):
    """A block without any stress drifts for 10^5 steps at a thousandth of the wave speed, with and without a finer level on its way. It must
    stay cold: round-off may add up as 10^5 steps times 1e-16 times the wave speed, some 1e-11 of Young's modulus."""
    young, density = 1e6, 1000.0
    wave = math.sqrt(young / density)
    end = bench.pick(100000, 2000) * 0.35 * 0.1 / wave
    way = 0.001 * wave * end
    length = 1.0 + math.ceil(10 * way) / 10
    shown = {}
    middle = round(5 * way) / 10
    for name, level in (("one level", ""), ("two levels", f"&level lower={0.6 + middle:.1f},0,0, upper={1.0 + middle:.1f},0.8,0.8 /")):
        out = bench.run(name.replace(" ", "_"), f"""&scene title='cold drift', end_time={end!r} /
&grid lower=0,0,0, upper={length:.1f},0.8,0.8, cell_size=0.1 /
&time time_step={0.35 * 0.1 / wave * 0.99!r} /
{level}
&material name='rubber', model='elastic', density={density}, young={young}, poisson=0 /
&body material='rubber', shape='box', lower=0.3,0.3,0.3, upper=0.6,0.5,0.5, velocity={0.001 * wave!r},0,0 /
&output directory='OUT', every={end / 20!r}, history_every={end / 200!r} /
""")
        rows = out.energy
        stress = [np.abs(one["stress"]).max() / young for one in out.snapshots()]
        shown[name] = stress
        bench.at_most(f"{name}: stress over Young's modulus", max(stress), 1e-11)
        bench.at_most(f"{name}: change of kinetic energy, relative", abs(rows["kinetic"] / rows["kinetic"][0] - 1), 1e-11)

    def draw(axes):
        for name, stress in shown.items():
            axes.semilogy(np.linspace(0, 1, len(stress)), np.maximum(stress, 1e-20), label=name)
        axes.set(xlabel="share of the run", ylabel="largest stress over E")
    bench.picture(draw)
