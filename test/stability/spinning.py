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
    """Largest change of angular momentum and of energy, relative, and of how far the farthest particle is
    from the middle."""
    rows = outcome.energy
    angular = np.stack([rows[f"angular_momentum_{axis}"] for axis in "xyz"], axis=1)
    energy = rows["kinetic"] + rows["strain"]
    seen = outcome.snapshots()
    reach = [np.linalg.norm(one["position"] - one["position"].mean(axis=0), axis=1).max() for one in seen]
    return (
        np.linalg.norm(angular - angular[0], axis=1).max() / np.linalg.norm(angular[0]),
        np.abs(energy / energy[0] - 1).max(),
        np.abs(np.array(reach) / reach[0] - 1).max(),
        energy.max() / energy[0],
    )


@hard_case("spin", short=True)
def spin_case(bench):
    """Ten turns with each kind of domain. A tenth of the angular momentum in ten turns is 1 % a turn: what a
    tool or a thrown body that turns once or twice would not notice. Energy must not grow beyond the half step
    between its two parts."""
    turns = bench.pick(10, 1)
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


@hard_case("vortex", short=True)
def vortex(bench):
    """The generalized vortex (Kamojjala et al. 2015): shear up to 7.1 times the amplitude, and back. A
    material point that is half a cell off (rms; one cell at most) can no longer be told from its neighbour.
    Domains along the axes do not follow shear: they hold together as long as it draws the particles no
    farther apart than a cell, shear of 1.5 with 8 a cell (2 along an edge) and 2.67 with 27; boxes that
    stretch are split where they bear tension, and follow further. Controls lie beyond, or take the shear
    stress out of the body force."""
    cells = bench.pick(16, 12)
    along_axes = "fixed", "stretch"
    # Amplitude, domains, particles a cell, and whether they follow: doc/user/hard_cases.md.
    settings = [(0.1, (*along_axes, "corners"), 8, "follow")]
    settings += bench.pick(
        [
            (0.2, along_axes, 8, "follow"),
            (1 / 3, ("fixed",), 8, "control"),
            (1 / 3, ("stretch",), 8, "follow"),
            (1 / 3, along_axes, 27, "follow"),
            (1 / 3, ("corners",), 8, "follow"),
            (0.5, ("corners",), 8, "follow"),
            (1.0, along_axes, 8, "control"),
            (1.0, ("corners",), 8, "open"),
        ],
        [],
    )
    found = {}
    for amplitude, domains, per_cell, kind in settings:
        for domain in domains:
            one = found[amplitude, domain, per_cell] = bench.measure(
                "vortex", amplitude, cells, domain, "right", per_cell
            )
            name = f"amplitude {amplitude:.2g}, {domain}, {per_cell} a cell"
            largest = max(one["half_largest"], one["whole_largest"])
            if kind == "control":
                bench.at_most(f"{name}: largest error of places, both [cells]", largest, 1.0, control=True)
                continue
            for stage, when in (("half", "at the turning point"), ("whole", "at the end")):
                bench.at_most(
                    f"{name}: rms error of places {when} [cells]",
                    one[f"{stage}_rms"],
                    0.5,
                    known=kind == "open",
                )
            bench.at_most(
                f"{name}: largest error of places, both [cells]", largest, 1.0, known=kind == "open"
            )
            bench.at_most(f"{name}: stopped", one["stopped"], 0)
    wrong = bench.measure("vortex", 0.1, cells, "corners", "wrong")
    bench.at_most(
        "amplitude 0.1, corners, wrong force: largest error of places [cells]",
        wrong["half_largest"],
        0.5,
        control=True,
    )

    def draw(axes):
        for domain, per_cell in sorted({(domain, per_cell) for _, domain, per_cell in found}):
            rms = sorted(
                (a, one["whole_rms"]) for (a, *setting), one in found.items() if setting == [domain, per_cell]
            )
            axes.loglog(*zip(*rms), "o-", label=f"{domain}, {per_cell}")
        axes.axhline(0.5, color="k", lw=0.5)
        axes.set(xlabel="amplitude [rad]", ylabel="rms error at the end [cells]")

    bench.picture(draw)


@hard_case("flying_apart")
def flying_apart(bench):
    """A block too soft to hold together spins: every particle goes straight on, and the block is turned,
    sheared and stretched to three times its size across the axis. One and eight particles a cell. Half a cell
    as in the vortex; fixed domains leave gaps there."""
    shown = {}
    for per_cell in (1, 8):
        for domain in ("fixed", "stretch", "corners"):
            end = 2.8284  # the block is sqrt(1 + t^2) = 3 times as large
            out = bench.run(
                f"{domain}_{per_cell}",
                f"""&scene title='flying apart', end_time={end} /
&grid lower=-3,-3,-1, upper=3,3,1, cell_size=0.2 /
&time domain='{domain}', time_step=0.01 /
&material name='soft', model='elastic', density=1000, young=1e-3, poisson=0 /
&body material='soft', shape='box', lower=-0.8,-0.6,-0.4, upper=0.8,0.6,0.4, angular_velocity=0,0,1, particles_per_cell={per_cell} /
&output directory='OUT', every={end / 2} /
""",
            )
            last = out.snapshots()[-1]
            # All particles, pieces of split ones too, must come from inside the block: place = (I + t W)
            # first place.
            moved = np.array([[1.0, -last.time, 0], [last.time, 1.0, 0], [0, 0, 1]])
            first = last["position"] @ np.linalg.inv(moved).T
            outside = np.maximum(np.abs(first) - (0.8, 0.6, 0.4), 0).max() * 3 / 0.2
            name = f"{domain}, {per_cell} a cell"
            bench.at_most(f"{name}: farthest outside the stretched block [cells]", outside, 0.5)
            shown[name] = holes(last["position"], 0.2, moved)
            bench.at_most(
                f"{name}: share of inner points that no particle is near",
                shown[name],
                0.01,
                control=domain == "fixed",
            )

    def draw(axes):
        axes.bar(range(len(shown)), list(shown.values()))
        axes.set_xticks(range(len(shown)), list(shown), rotation=45, ha="right")
        axes.set(ylabel="share of inner points without a particle")

    bench.picture(draw)


def holes(places, cell, moved):
    """Share of the points of a fine lattice well inside the stretched block with no particle within 0.75
    cells."""
    points = (
        np.stack(
            np.meshgrid(*[np.linspace(-0.8, 0.8, 17) * edge for edge in (0.8, 0.6, 0.4)]), axis=-1
        ).reshape(-1, 3)
        @ moved.T
    )
    return float(np.mean([np.abs(places - point).max(axis=1).min() > 0.75 * cell for point in points]))


@hard_case("fast_spin", short=True)
def fast_spin(bench):
    """A rubber block whose rim runs at three times the wave speed is flung out to twice its size, torn
    between its strength and its spin. Nothing feeds it: energy may not grow (one part in a hundred for the
    half step between its parts); momentum stays. The material comes together across the block faster than its
    waves run: a shock, for which there is bulk viscosity. The control is affine transfer without it; what the
    transfer then puts in must fall with the cell."""
    rate = 3 * WAVE / 0.5
    end = bench.pick(0.05, 0.015)
    viscous = "&bulk_viscosity /"
    shown = {}
    created = {}
    domains = "fixed", "stretch", "corners"
    settings = [(domain, "affine", 0.1, viscous) for domain in domains] + [
        (domain, "plain", 0.1, "") for domain in domains
    ]
    settings += [("fixed", "affine", 0.1, "")] + bench.pick([("fixed", "affine", 0.05, viscous)], [])
    for domain, transfer, cell, effect in settings:
        out = bench.run(
            f"{domain}_{transfer}_{cell}_{len(effect)}",
            f"""&scene title='fast spin', end_time={end} /
&grid lower=-4,-4,-2, upper=4,4,2, cell_size={cell} /
&time domain='{domain}', transfer='{transfer}' /
{effect}
&material name='rubber', model='neo_hookean', density={DENSITY}, young={YOUNG}, poisson={POISSON} /
&body material='rubber', shape='box', lower=-0.4,-0.3,-0.2, upper=0.4,0.3,0.2, angular_velocity=0,0,{rate!r} /
&output directory='OUT', every={end / 2}, history_every={end / 400} /
""",
        )
        rows = out.energy
        energy = (rows["kinetic"] + rows["strain"]) / (rows["kinetic"] + rows["strain"])[0]
        name = f"{domain}, {transfer}" + ", bulk viscosity" * (effect > "") + ", half the cell" * (cell < 0.1)
        shown[name] = rows["time"], energy
        bench.at_most(
            f"{name}: largest energy over the first",
            energy,
            1.01,
            control=transfer == "affine" and not effect,
        )
        momentum = max(abs(rows[f"momentum_{axis}"]).max() for axis in "xyz") / (rows["mass"][0] * 3 * WAVE)
        bench.at_most(f"{name}: momentum over mass times speed of the rim", momentum, 1e-12)
        if domain == "fixed" and effect:
            created[cell] = rows["balance_error"].max()
    if len(created) == 2:
        bench.at_most(
            "fixed, affine, bulk viscosity: largest balance error with half the cell over that with the cell",
            created[0.05] / created[0.1],
            0.5,
        )

    def draw(axes):
        for name, (time, energy) in shown.items():
            axes.plot(time * 1e3, energy, lw=0.8, label=name)
        axes.set(xlabel="time [ms]", ylabel="energy over the first")

    bench.picture(draw)
