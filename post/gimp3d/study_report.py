"""What a study says: tables (CSV), a work-precision diagram, sentences."""

import csv
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

markers = "osD^v<>Phx*+"


def write_csv(path, rows):
    """A list of dictionaries with the same names."""
    partial = path.with_name(path.name + ".part")
    with open(partial, "w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    os.replace(partial, path)


def write_text(path, text):
    partial = path.with_name(path.name + ".part")
    partial.write_text(text)
    os.replace(partial, path)


def shown(value, digits=3):
    if value is None:
        return ""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def markdown(rows, columns):
    """columns: (name in the rows, title)."""
    lines = ["| " + " | ".join(title for _, title in columns) + " |", "|" + "---|" * len(columns)]
    lines += ["| " + " | ".join(shown(row[name]) for name, _ in columns) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def diagram(path, title, points, front, reference_error, orders):
    """Error over core-seconds. points: family -> list of (core-seconds, error in per cent, is on the front);
    front: two arrays."""
    plt.rcParams.update(
        {
            "figure.dpi": 130,
            "font.size": 9,
            "axes.grid": True,
            "grid.color": "0.9",
            "axes.axisbelow": True,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "legend.frameon": False,
        }
    )
    figure, ax = plt.subplots(figsize=(7.2, 4.4), layout="constrained")
    ax.step(
        *front,
        where="post",
        color="0.75",
        linewidth=5,
        solid_joinstyle="miter",
        zorder=1,
        label="Pareto front",
    )
    for number, (family, ones) in enumerate(points.items()):
        ones = sorted(ones)
        order = f", order {orders[family]:.1f}" if orders.get(family) is not None else ""
        (line,) = ax.plot(
            [one[0] for one in ones],
            [one[1] for one in ones],
            marker=markers[number % len(markers)],
            markersize=5,
            linewidth=1.1,
            color=f"C{number % 10}",
            label=family + order,
            zorder=2,
        )
        best = [one for one in ones if one[2]]
        ax.plot(
            [one[0] for one in best],
            [one[1] for one in best],
            marker="o",
            markersize=10,
            markerfacecolor="none",
            markeredgecolor="k",
            linestyle="none",
            zorder=3,
        )
    if reference_error > 0:
        ax.axhline(
            reference_error, color="0.4", linestyle=":", linewidth=1, label="the reference's own error"
        )
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="core-seconds",
        ylabel="error [% of the largest value]",
        title=title,
    )
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5), numticks=20))
        axis.set_major_formatter(matplotlib.ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
    figure.legend(loc="outside right upper", fontsize=8)
    partial = path.with_name(f".{path.name}.part")
    figure.savefig(partial, format="png")
    os.replace(partial, path)
    plt.close(figure)


def cost_sentence(front, target):
    """What an error (per cent) costs."""
    seconds, how = front.cost_of(target)
    if seconds is not None:
        return f"{target:g} % costs {seconds:.2g} core-seconds ({basis(front, how)})."
    if target > front.errors[0]:
        return (
            f"{target:g} % costs less than {front.costs[0]:.2g} core-seconds: the cheapest run has "
            f"{front.errors[0]:.2g} %."
        )
    return f"{target:g} % is not reached ({how}): {best(front)}."


def budget_sentence(front, seconds, reference_error):
    """What seconds of one core buy; nothing is extrapolated below the reference's own error (per cent)."""
    error, how = front.error_for(seconds)
    if error is not None and how and error < reference_error:
        return (
            f"In {seconds:g} s of one core you get less than the {reference_error:g} % that the reference is "
            f"known to: {best(front)}."
        )
    if error is not None:
        return f"In {seconds:g} s of one core you get {error:.2g} % ({basis(front, how)})."
    if seconds < front.costs[0]:
        return (
            f"In {seconds:g} s of one core no run ends: the cheapest takes {front.costs[0]:.2g} s and has "
            f"{front.errors[0]:.2g} %."
        )
    return f"In {seconds:g} s of one core you get at least what the best run has ({how}): {best(front)}."


def basis(front, how):
    return f"extrapolated: {best(front)}" if how else "between runs of the Pareto front"


def best(front):
    return f"the best run has {front.errors[-1]:.2g} % in {front.costs[-1]:.2g} core-seconds"
