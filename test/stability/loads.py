"""Bodies under load: squeezed to a tenth, nearly incompressible, stiff over soft, at the edge of the time
step, for very long."""

import math

import numpy as np

from hard_case import hard_case
from empty_cells import CELL, WAVE, blocks, excited, grown


def squeezed_load(stretch, young, poisson):
    """Force over first area of a free neo-Hookean cube squeezed to `stretch` of its height: the lateral
    stretch that leaves its sides free of stress, by bisection (theory.md, eq. neo-hookean)."""
    shear, bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))

    def stresses(across):
        volume = stretch * across**2
        mean = (stretch**2 + 2 * across**2) / 3
        factor = shear * volume ** (-5 / 3)
        return factor * (across**2 - mean) + bulk * (volume - 1), factor * (stretch**2 - mean) + bulk * (
            volume - 1
        )

    low, high = 0.5, 10.0
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (low, middle) if stresses(middle)[0] > 0 else (middle, high)
    return -stresses(low)[1] * low**2


def wrinkling_share(poisson):
    """Share of its height by which a free neo-Hookean block is squeezed when a flat free side becomes
    unstable (Biot 1963): where a wave along the load, exp(ikz) sinking into the body, lies on the state of
    squeezed_load and leaves the side free of stress. It has no length, so that no block, and no grid, keeps
    the uniform state beyond."""
    shear, bulk = 1 / (2 * (1 + poisson)), 1 / (3 * (1 - 2 * poisson))

    def stress(deformation):  # first Piola-Kirchhoff
        volume, turned = np.linalg.det(deformation), np.linalg.inv(deformation).T
        deviator = deformation - np.sum(deformation**2) / 3 * turned
        return shear * volume ** (-2 / 3) * deviator + bulk * (volume - 1) * volume * turned

    def stress_of_wave(stretch):
        low, high = 0.5, 3.0
        for _ in range(60):
            across = (low + high) / 2
            low, high = (
                (low, across) if stress(np.diag([across, across, stretch]))[0, 0] > 0 else (across, high)
            )
        state, moduli, step = np.diag([across, across, stretch]), np.zeros((3, 3, 3, 3)), 1e-6
        for k, l in np.ndindex(3, 3):
            change = np.zeros((3, 3))
            change[k, l] = step
            moduli[:, :, k, l] = (stress(state + change) - stress(state - change)) / (2 * step)
        moduli = np.einsum("pP,qQ,iPjQ->piqj", state, state, moduli)  # of the increment on the squeezed state
        inward, along, mixed, other = moduli[0, :, 0], moduli[2, :, 2], moduli[0, :, 2], moduli[2, :, 0]
        pencil = np.block(
            [
                [np.zeros((3, 3)), np.eye(3)],
                [np.linalg.solve(inward, along), -1j * np.linalg.solve(inward, mixed + other)],
            ]
        )
        rates, vectors = np.linalg.eig(pencil)
        sinking = np.argsort(-rates.real)[:3]
        rates, waves = rates[sinking], vectors[:3, sinking]
        return (np.linalg.det(inward @ waves * rates + 1j * mixed @ waves) / np.linalg.det(waves)).real

    low, high = 0.3, 0.9
    first = stress_of_wave(high)
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (low, middle) if stress_of_wave(middle) * first > 0 else (middle, high)
    return 1 - high


@hard_case("squeezed")
def squeezed(bench):
    """A quarter of a neo-Hookean block, 4 x 4 x 8 cells, under a frictionless flat tool to a tenth of its
    height, slowly: each second takes the same share of the height that is left. The exact load is that of
    free lateral expansion, which is stable up to wrinkling_share; so far the block must come, and beyond no
    load is compared with it. A tool's load is read to 5 %: of cubes to 30 % (40 % with 27 particles a cell),
    for cubes overlap beyond, and a run says so; of boxes to 40 %."""
    half, left = 4, 0.1
    height = 2.0 * half
    shown = {}
    # Domain, particles a cell, Poisson's ratio, last share of the height, where the load is read.
    settings = [
        ("fixed", 8, 0.49, 1 - left, (0.3,)),
        ("stretch", 8, 0.49, 1 - left, (0.4,)),
        ("corners", 8, 0.49, 1 - left, (0.3, 0.5)),
        ("fixed", 27, 0.49, 0.56, (0.4,)),
        ("stretch", 27, 0.49, 0.56, (0.4,)),
        ("corners", 27, 0.49, 0.85, (0.3, 0.5)),
        ("corners", 8, 0.3, 1 - left, (0.3, 0.4)),
    ]
    stable = {poisson: wrinkling_share(poisson) for poisson in (0.3, 0.49, 0.4999)}
    bench.at_most(
        "squeezing at which free sides wrinkle, Poisson 0.4999, off Biot's 0.556",
        abs(stable[0.4999] - 0.556),
        0.002,
    )
    for domain, per_cell, poisson, last, read in settings:
        name = f"{domain}, {per_cell} a cell, Poisson {poisson}"
        young = 1e6
        wave = math.sqrt(young / 1000 * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson))
        rate = 0.006 * wave / height
        times = np.linspace(0, -math.log(1 - last) / rate, 30)
        numbers = [
            ",".join(f"{x:.8g}" for x in values) for values in (times, height * rate * np.exp(-rate * times))
        ]
        out = bench.run(
            f"{domain}_{per_cell}_{poisson}",
            f"""&scene title='squeezed', end_time={float(times[-1])!r} /
&grid lower=0,0,0, upper={5 * half},{5 * half},{2 * half + 2}, cell_size=1,
      boundary='symmetry','free','symmetry','free','symmetry','free' /
&time domain='{domain}', safety={0.35 if per_cell == 27 else 0.4} /
&material name='rubber', model='neo_hookean', density=1000, young={young}, poisson={poisson} /
&body material='rubber', shape='box', lower=0,0,0, upper={half},{half},{2 * half}, particles_per_cell={per_cell} /
&tool name='flat', shape='flat', radius={10 * half}, tip=0,0,{2 * half}, times={numbers[0]},
      speeds={numbers[1]}, penetration_factor=0.5 /
&damping kind='viscous', coefficient={0.1 * wave / height!r} /
&anti_locking /
&output directory='OUT', history_every={float(times[-1]) / 2000!r} /
""",
            allowed=(0, 3),
        )
        rows = out.tool("flat")
        share, load = rows["depth"] / height, rows["load_z"] / half**2 / young
        shown[name] = share, load
        bench.at_least(
            f"{name}: squeezed by this share of the height",
            share[-1],
            round(min(stable[poisson], last), 3) - 0.002,
        )
        if domain == "stretch" and last == 1 - left:
            bench.at_least(
                f"{name}: squeezed by this share of the height, all the way", share[-1], last - 0.002
            )
        bench.at_most(
            f"{name}: ended otherwise than with 0 or a sentence",
            float(out.status != 0 and not out.sentence),
            0,
        )
        for at in read:
            near = abs(share - at) < 0.01
            exact = [squeezed_load(1 - d, 1.0, poisson) for d in share[near]]
            off = abs(np.mean(load[near]) / np.mean(exact) - 1) if near.any() else np.inf
            bench.at_most(
                f"{name}: load at {at:.0%} off the exact {squeezed_load(1 - at, 1.0, poisson):.3g} E, "
                "relative",
                off,
                0.05 if at <= 0.5 else 0.1,
            )

    def draw(axes):
        shares = np.linspace(0.01, 0.9, 90)
        axes.semilogy(
            shares,
            [squeezed_load(1 - s, 1.0, 0.49) for s in shares],
            "k",
            lw=0.8,
            label="exact, Poisson 0.49",
        )
        for name, (share, load) in shown.items():
            axes.semilogy(share, np.maximum(load, 1e-3), lw=0.8, label=name)
        axes.set(xlabel="squeezed by this share", ylabel="load over first area and E", ylim=(1e-2, None))

    bench.picture(draw)


@hard_case("incompressible", short=True)
def incompressible(bench):
    """Poisson 0.4999: two halves of a block meet and ring in flight, with anti-locking (Young's modulus 1
    MPa, flight at 5 m/s, as in test/verification/locking.py). Energy must not grow, at rest on the grid or in
    flight."""
    poisson, speed = 0.4999, 5.0
    wave = math.sqrt(1e3 * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson))
    steps = bench.pick(6000, 600)
    shown = {}
    for name, effect in (("without anti-locking", ""), ("with anti-locking", "&anti_locking /")):
        end = steps * 0.35 * 0.1 / (wave + speed)
        cells = math.ceil(10 * (2 + speed * end))
        out = bench.run(
            name.split()[0],
            f"""&scene title='two halves that ring', end_time={end!r} /
&grid lower=0,0,0, upper={cells / 10},{cells / 10},1, cell_size=0.1 /
&material name='rubber', model='elastic', density=1000, young=1e6, poisson={poisson} /
&body material='rubber', shape='box', lower=0.3,0.3,0.3, upper=0.7,0.7,0.7, velocity={speed + 0.5},{speed / 2},0 /
&body material='rubber', shape='box', lower=0.7,0.3,0.3, upper=1.1,0.7,0.7, velocity={speed - 0.5},{speed / 2},0 /
{effect}
&output directory='OUT', history_every={end / 200!r} /
""",
        )
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
    """A stiff layer on one 10^4 times softer, equally thick, confined, Poisson 0, pressed slowly by 5 % of
    the soft one. Exactly, the stress is E ln(1 - strain) of the soft layer everywhere (theory.md, eq.
    elastic). Load within 2 %; mean stress of each layer of cells within 5 %; no particle off by more than
    half of the stress. The layers are two contact groups; in one velocity field all bars are missed: the
    control."""
    shown = {}
    for cells, groups in bench.pick(((4, True), (8, True), (4, False)), ((4, True),)):
        load, height, stress, means, top = stiff_column(bench, cells, groups)
        name = f"{cells} soft cells" + ("" if groups else ", one velocity field")
        shown[name] = height / cells, stress
        for what, off, bar in (
            ("load", load, 0.02),
            ("mean stress of a layer of cells", abs(means - 1), 0.05),
            ("stress of a particle", abs(stress - 1), 0.5),
        ):
            bench.at_most(f"{name}: {what} off the exact, relative", off, bar, control=not groups)

    def draw(axes):
        for name, (height, stress) in shown.items():
            axes.plot(stress, height, ".", ms=4, label=name)
        axes.axvline(1, color="k", lw=0.5)
        axes.axhline(0.95, color="r", lw=0.5)
        axes.set(xlabel="stress over the exact", ylabel="height over that of the soft layer")

    bench.picture(draw)


def stiff_column(bench, cells, groups):
    """Of two contact groups or one: load off the exact one; height (cells) and stress over the exact one of
    the particles; mean stress of the layers of cells; height."""
    soft, ratio, pressed = 1e6, 1e4, 0.05
    # The stiff layer on the soft spring swings at this rate; damped critically, pressed over 2 s, held for 1
    # s. Cells of 4/cells m.
    swing, cell = math.sqrt(soft / 4 / (1000 * 4)), 4 / cells
    speed = pressed * 4 / 1.8
    soft_group, stiff_group = (", contact_group='soft'", ", contact_group='stiff'") if groups else ("", "")
    out = bench.run(
        f"column_{cells}_{groups}",
        f"""&scene title='stiff on soft', end_time=3 /
&grid lower=0,0,0, upper={cell},{cell},10, cell_size={cell}, boundary='symmetry','symmetry','symmetry','symmetry','symmetry','free' /
&material name='soft', model='elastic', density=1000, young={soft}, poisson=0 /
&material name='stiff', model='elastic', density=1000, young={soft * ratio}, poisson=0 /
&body material='soft', shape='box', lower=0,0,0, upper={cell},{cell},4 {soft_group} /
&body material='stiff', shape='box', lower=0,0,4, upper={cell},{cell},8 {stiff_group} /
&tool name='flat', shape='flat', radius=8, tip=0,0,8, times=0,0.2,1.8,2, speeds=0,{speed},{speed},0, penetration_factor=0.5 /
&damping kind='viscous', coefficient={2 * swing} /
&output directory='OUT', history_every=0.003 /
""",
    )
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
    """The largest safety that a scene may ask for, with each kind of domain and number of particles. A longer
    step, given by time_step, must be refused (status 2); test/verification/stability_limit finds where it
    would fail."""
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
            bench.at_most(
                f"{domain}, {per_cell} a cell, safety {safety}: largest energy later over that at first",
                grown(time, energy),
                1.01,
            )
    step = 0.41 * CELL / WAVE
    out = bench.run(
        "too_long",
        blocks(offsets, 0.0, steps).replace("&time ", f"&time time_step={step!r}, "),
        allowed=(0, 2, 3),
    )
    bench.at_most("a given step of 0.41 cells over the wave speed: exit status off 2", abs(out.status - 2), 0)

    def draw(axes):
        for name, (time, energy) in shown.items():
            axes.plot(time / time[-1] * steps, energy, lw=0.8, label=name)
        axes.set(xlabel="steps", ylabel="energy about the flight over the first")

    bench.picture(draw)


@hard_case("long")
def long(bench):
    """10^5 steps: a bar rings in its first mode, at rest on the grid and creeping through it, with and
    without a finer level in its middle. Energy must not grow from the first ten periods to the last; a
    hundredth is allowed for where peaks fall between steps."""
    periods = bench.pick(900, 30)
    for name, speed, levels in (
        ("one level, at rest", 0.0, 1),
        ("one level, creeping", 0.001, 1),
        ("two levels, at rest", 0.0, 2),
    ):
        share = 1 if levels == 1 else 3
        one = bench.measure("crossing", speed, 0, "fixed", periods // share, levels)
        bench.at_most(f"{name}: largest energy of the last period over the first", one["energy"], 1.01)
        bench.at_most(f"{name}: change of momentum, relative", one["momentum"], 1e-11)


@hard_case("cold_drift")
def cold_drift(bench):
    """A block without any stress drifts for 10^5 steps at a thousandth of the wave speed, with and without a
    finer level on its way. It must stay cold: round-off may add up as 10^5 steps times 1e-16 times the wave
    speed, some 1e-11 of Young's modulus."""
    young, density = 1e6, 1000.0
    wave = math.sqrt(young / density)
    end = bench.pick(100000, 2000) * 0.35 * 0.1 / wave
    way = 0.001 * wave * end
    length = 1.0 + math.ceil(10 * way) / 10
    shown = {}
    middle = round(5 * way) / 10
    for name, level in (
        ("one level", ""),
        ("two levels", f"&level lower={0.6 + middle:.1f},0,0, upper={1.0 + middle:.1f},0.8,0.8 /"),
    ):
        out = bench.run(
            name.replace(" ", "_"),
            f"""&scene title='cold drift', end_time={end!r} /
&grid lower=0,0,0, upper={length:.1f},0.8,0.8, cell_size=0.1 /
&time time_step={0.35 * 0.1 / wave * 0.99!r} /
{level}
&material name='rubber', model='elastic', density={density}, young={young}, poisson=0 /
&body material='rubber', shape='box', lower=0.3,0.3,0.3, upper=0.6,0.5,0.5, velocity={0.001 * wave!r},0,0 /
&output directory='OUT', every={end / 20!r}, history_every={end / 200!r} /
""",
        )
        rows = out.energy
        stress = [np.abs(one["stress"]).max() / young for one in out.snapshots()]
        shown[name] = stress
        bench.at_most(f"{name}: stress over Young's modulus", max(stress), 1e-11)
        bench.at_most(
            f"{name}: change of kinetic energy, relative",
            abs(rows["kinetic"] / rows["kinetic"][0] - 1),
            1e-11,
        )

    def draw(axes):
        for name, stress in shown.items():
            axes.semilogy(np.linspace(0, 1, len(stress)), np.maximum(stress, 1e-20), label=name)
        axes.set(xlabel="share of the run", ylabel="largest stress over E")

    bench.picture(draw)
