"""Cell crossing: a stressed bar carried through the grid."""
from hard_case import hard_case

# Share of the amplitude of the stress. Bardenhagen and Kober (2004) made GIMP because particles of the plain method that cross a cell
# leave errors of the order of the stress itself. A twentieth is what a reader of a stress plot would not see.
NOISE = 0.05
# Nothing feeds the bar: its energy cannot grow. One part in a hundred is for the peaks of a period that fall between two steps.
GROWTH = 1.01


@hard_case("crossing", short=True)
def crossing(bench):
    """A ringing bar at 0 to 0.5 of the wave speed, 0 to 45 degrees off its axis, with each kind of domain and with linear weights."""
    speeds = bench.pick((0.01, 0.05, 0.2, 0.5), (0.05,))
    angles = bench.pick((0, 20, 45), (20,))
    noise = {}
    for weights in ("fixed", "stretch", "corners", "linear"):
        found = {(0.0, 0): bench.measure("crossing", 0.0, 0, weights)}
        found |= {(speed, angle): bench.measure("crossing", speed, angle, weights) for speed in speeds for angle in angles}
        noise[weights] = {key: one["noise"] for key, one in found.items()}
        control = weights == "linear"
        carried = [value for (speed, _), value in noise[weights].items() if speed > 0]
        bench.at_most(f"{weights}: stress error of the carried bar, over the amplitude",
                      min(carried) if control else max(carried), NOISE, control=control, known=not bench.short)
        energies = [one["energy"] for (speed, _), one in found.items() if speed > 0]
        bench.at_most(f"{weights}: largest energy of the third period over the first", min(energies) if control else max(energies), GROWTH,
                      control=control)

    # 0.032 of the wave speed is a cell in a period: the stiffness of the bar's ends, which changes from node to node, keeps step.
    bench.at_most("fixed: stress error when a period carries it over one cell",
                  bench.measure("crossing", 0.03125, 0, "fixed")["noise"], NOISE, known=True)

    def draw(axes):
        for weights, found in noise.items():
            for angle in angles[-1:]:
                axes.loglog(speeds, [min(found[s, angle], 1e3) for s in speeds], "o-", label=weights)
        axes.axhline(NOISE, color="k", lw=0.5)
        axes.set(xlabel=f"speed over wave speed, {angles[-1]} degrees", ylabel="stress error over amplitude (cut at 1000)")
    bench.picture(draw)
