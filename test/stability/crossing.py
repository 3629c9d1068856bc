"""Cell crossing: a stressed bar carried through the grid."""

from hard_case import hard_case

# Share of the amplitude of the stress. Bardenhagen and Kober (2004) made GIMP because particles of the plain
# method that cross a cell
# leave errors of the order of the stress itself. A twentieth is what a reader of a stress plot would not see.
NOISE = 0.05
# Nothing feeds the bar: its energy cannot grow. One part in a hundred is for the peaks of a period that fall
# between two steps.
GROWTH = 1.01


# Of the wave speed: a cell in a period of the ringing. A particle's strain rate is that of its cell; where it
# stands in the cell then keeps
# step with how the strain rate varies along the cell.
RESONANCE = 0.03125


@hard_case("crossing", short=True)
def crossing(bench):
    """A ringing bar at 0 to 0.5 of the wave speed, 0 to 45 degrees off its axis and at the resonance, with
    each kind of domain, and with linear weights. Of 8 particles a cell the mean of a cell counts, which is
    what nodes feel; of one a cell the particle."""
    speeds = bench.pick((0.01, 0.05, 0.2, 0.5), (0.05,))
    angles = bench.pick((0, 20, 45), (20,))
    flights = [(speed, angle) for speed in speeds for angle in angles]
    shown = {}

    def fly(weights, per_cell, flights):
        return {one: bench.measure("crossing", *one, weights, 3, 1, per_cell) for one in flights}

    def largest(found, figure):
        return max(one[figure] for one in found.values())

    for weights in ("fixed", "stretch", "corners"):
        found = fly(weights, 8, flights + [(RESONANCE, 0)])
        single = fly(weights, 1, flights + [(RESONANCE, 0)])
        shown |= {f"{weights}, a particle of 8": found, f"{weights}, one a cell": single}
        fast = [values["noise"] for one, values in found.items() if one[0] > 0.1]
        resonant = found[RESONANCE, 0]["noise"]
        name = f"{weights}, 8 a cell"
        bench.at_most(
            f"{name}: error of a cell's mean stress, over the amplitude", largest(found, "mean"), NOISE
        )
        if fast:
            bench.at_most(f"{name}: stress error of the fast bar, over the amplitude", max(fast), NOISE)
        bench.at_most(
            f"{name}: stress error of particles at the resonance, over the amplitude",
            resonant,
            NOISE,
            control=True,
        )
        if weights == "fixed":
            half = bench.measure("crossing", RESONANCE / 2, 0, weights, 3, 1, 8, 32)["noise"]
            bench.at_most(
                f"{name}: that error with half the cell over that with the cell", half / resonant, 0.6
            )
        bench.at_most(
            f"{name}: largest energy of the third period over the first", largest(found, "energy"), GROWTH
        )
        name = f"{weights}, one a cell"
        bench.at_most(
            f"{name}: stress error of the carried bar, over the amplitude", largest(single, "noise"), NOISE
        )
        bench.at_most(
            f"{name}: largest energy of the third period over the first", largest(single, "energy"), GROWTH
        )
    linear = fly("linear", 8, flights).values()
    bench.at_most(
        "linear: stress error of the carried bar, over the amplitude",
        min(one["noise"] for one in linear),
        NOISE,
        control=True,
    )
    bench.at_most(
        "linear: largest energy of the third period over the first",
        min(one["energy"] for one in linear),
        GROWTH,
        control=True,
    )

    def draw(axes):
        for name, found in shown.items():
            along = sorted((speed, one["noise"]) for (speed, angle), one in found.items() if angle == 0)
            axes.loglog(
                [speed for speed, _ in along], [min(value, 1e3) for _, value in along], "o-", label=name
            )
        axes.axhline(NOISE, color="k", lw=0.5)
        axes.set(
            xlabel="speed over wave speed, 0 degrees", ylabel="stress error over amplitude (cut at 1000)"
        )

    bench.picture(draw)
