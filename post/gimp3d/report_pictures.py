"""The pictures of a report: each by itself, so that a page can lay them out for any width, as PNG in the
page."""

import base64
import io
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.ticker import MaxNLocator

from . import indentation
from . import plots
from .run_data import Particles, Unreadable

width = 4.6  # of a picture, inches
dots = 160  # an inch
least_range = 1e-3  # of the colours of a surface, of its largest value
most_pixels = 700  # along a side of a view from above


@dataclass
class Picture:
    name: str  # id in the page
    uri: str
    alt: str
    caption: str
    size: tuple  # pixels


def picture(figure, name, alt, caption):
    """The figure as data of the page; it is closed."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=dots)
    plt.close(figure)
    data = file.getvalue()
    size = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    return Picture(name, "data:image/png;base64," + base64.b64encode(data).decode(), alt, caption, size)


def round_steps(count):
    return MaxNLocator(count, steps=[1, 2, 2.5, 5, 10])


def axes_for(view):
    """A figure of one panel for limits left, right, bottom, top, and a place for its colour bar above. Laid
    out by hand, in inches: matplotlib's layout engines take most of the time of a picture."""
    left, right, bottom, top, bar = 0.72, 0.22, 0.50, 0.70, 0.13
    inside = across = width - left - right
    height = inside * (view[3] - view[2]) / (view[1] - view[0])
    if height > 6.0:  # tall bodies
        inside, height = inside * 6.0 / height, 6.0
    whole = bottom + height + top
    figure = plt.figure(figsize=(width, whole))
    ax = figure.add_axes(
        [(left + 0.5 * (across - inside)) / width, bottom / whole, inside / width, height / whole]
    )
    ax.xaxis.set_major_locator(round_steps(min(8, max(1, int(inside / 0.45)))))
    ax.yaxis.set_major_locator(round_steps(min(8, max(1, int(height / 0.3)))))
    colours = figure.add_axes([left / width, (bottom + height + 0.12) / whole, across / width, bar / whole])
    return figure, ax, colours


def values_text(low, high, factor, unit):
    return f"{low / factor:.3g} to {high / factor:.3g} {unit}".rstrip()


def bare(label):
    """A label of a picture as plain text."""
    return label.replace("$", "").replace("\\sigma_", "stress ").replace("{", "").replace("}", "")


# ---- section
# ------------------------------------------------------------------------------------------------------------


def section(run, particles):
    """Normal stress along the tool, von Mises stress, and what a plastic law has, whole and near the
    contact."""
    cut = plots.Section(run, particles)
    for number, (label, values, unit) in enumerate(cut.panels + cut.more):
        for view, words in reversed(list(zip(cut.views, ("", ", near the contact")))):
            figure, ax, colours = axes_for(view)
            drawn, value_unit, edges = cut.draw(ax, values, unit, view)
            figure.colorbar(
                drawn,
                cax=colours,
                label=f"{label} [{value_unit or '1'}]",
                extend="both",
                orientation="horizontal",
                ticklocation="top",
                ticks=round_steps(5),
            )
            low, high = cut.limits(values)
            factor = plots.scaled(unit, [low, high])[0] if unit == "Pa" else 1.0
            yield picture(
                figure,
                f"section-{number}{'-near' if words else ''}",
                f"{cut.place}{words}: {bare(label)}, {values_text(low, high, factor, value_unit)}",
                f"{bare(label)[0].upper()}{bare(label)[1:]}{words}; {cut.place}"
                + "".join(f"; outlined: {edge.get_label()}" for edge in edges),
            )


most_frames = 10  # of a page


def frames(run, paths, reference):
    """Von Mises stress near the contact at each snapshot (some, if there are many), with the view and the
    colours of the reference."""
    cut = plots.Section(run, reference)
    view, (label, values, unit) = cut.views[-1], cut.panels[1]
    limits = cut.limits(values)
    factor, name = plots.scaled(unit, limits)
    chosen = [paths[n] for n in np.unique(np.linspace(0, len(paths) - 1, most_frames).round().astype(int))]
    for number, path in enumerate(chosen if len(paths) > most_frames else paths):
        particles = Particles(path)
        if not particles.ids.size:
            continue
        section = plots.Section(run, particles)
        figure, ax, colours = axes_for(view)
        drawn, _, _ = section.draw(ax, section.panels[1][1], unit, view)
        drawn.set_array(section.panels[1][1] / factor)
        drawn.set_clim(*(limit / factor for limit in limits))
        figure.colorbar(
            drawn,
            cax=colours,
            label=f"{label} [{name}]",
            extend="max",
            orientation="horizontal",
            ticklocation="top",
            ticks=round_steps(5),
        )
        yield picture(figure, f"frame-{number}", f"{section.place}: {label}", section.place)


# ---- surface from above
# ------------------------------------------------------------------------------------------------------------


class Surface:
    """What is seen of the bodies along the first tool's axis, or down z where there is no tool."""

    def __init__(self, run, particles):
        self.run, self.particles = run, particles
        self.half = plots.half_sizes(particles)
        self.position = particles["position"]
        axis = indentation.unit_axis(run.tools[0]) if run.tools else np.array([0.0, 0.0, -1.0])
        self.up = int(np.argmax(np.abs(axis)))
        self.sign = -np.sign(axis[self.up])
        self.a, self.b = [i for i in (0, 1, 2) if i != self.up]
        self.top = self.sign * self.position[:, self.up] + self.half[:, self.up]
        self.rank = np.empty(self.top.size, dtype=np.int64)
        self.order = np.argsort(self.top, kind="stable")
        self.rank[self.order] = np.arange(self.top.size)
        self.level = self.first_surface(axis)
        lower, upper = (self.position + side * self.half for side in (-1, 1))
        self.whole = [
            lower[:, self.a].min(),
            upper[:, self.a].max(),
            lower[:, self.b].min(),
            upper[:, self.b].max(),
        ]
        self.views = [self.whole]
        near = plots.close_up(run, particles, self.whole, [0.0, 0.0], self.a, self.up) if run.tools else None
        if near is not None:  # as wide as that of the section, about the tip
            reach, tip = 0.5 * (near[1] - near[0]), np.array(run.tools[0]["tip"])
            starts = [
                max(low, min(tip[i] - reach, high - 2 * reach))
                for i, low, high in ((self.a, *self.whole[:2]), (self.b, *self.whole[2:]))
            ]
            self.views.append(
                [
                    starts[0],
                    min(starts[0] + 2 * reach, self.whole[1]),
                    starts[1],
                    min(starts[1] + 2 * reach, self.whole[3]),
                ]
            )

    def first_surface(self, axis):
        """Height of the surface at the start, where the first tool meets it; None where that is not known."""
        if not self.run.tools or abs(axis[self.up]) < 0.999:
            return None
        try:
            history = self.run.tool_history(self.run.tools[0])
            if history is None:
                return None
            _, gap = indentation.indented_body(self.run.case, self.run.tools[0], history)
        except Unreadable:
            return None
        return -(np.dot(self.run.tools[0]["tip"], axis) + gap)

    def seen(self, view):
        """Index of the particle that is seen in each pixel, rows upwards; -1 where there is none."""
        size = 2 * self.half[:, [self.a, self.b]].min()
        pitch = max(size, max(view[1] - view[0], view[3] - view[2]) / most_pixels)
        columns, rows = (max(1, int(np.ceil((view[2 * i + 1] - view[2 * i]) / pitch - 1e-6))) for i in (0, 1))
        first, last = [], []
        for i, axis, count in ((0, self.a, columns), (1, self.b, rows)):
            low, high = (
                (self.position[:, axis] + side * 1.01 * self.half[:, axis] - view[2 * i]) / pitch - 0.5
                for side in (-1, 1)
            )
            first.append(np.ceil(low).astype(int))
            last.append(np.minimum(np.floor(high).astype(int), count - 1))
        inside = np.flatnonzero(
            (first[0] <= last[0]) & (first[1] <= last[1]) & (last[0] >= 0) & (last[1] >= 0)
        )
        best = np.full(rows * columns, -1, dtype=np.int64)
        first, last, rank = [one[inside] for one in first], [one[inside] for one in last], self.rank[inside]
        if inside.size:
            for i in range(int((last[0] - first[0]).max()) + 1):
                for j in range(int((last[1] - first[1]).max()) + 1):
                    column, row = first[0] + i, first[1] + j
                    there = (column <= last[0]) & (row <= last[1]) & (column >= 0) & (row >= 0)
                    np.maximum.at(best, row[there] * columns + column[there], rank[there])
        found = np.full(best.size, -1, dtype=np.int64)
        found[best >= 0] = self.order[best[best >= 0]]
        extent = view[0], view[0] + columns * pitch, view[2], view[2] + rows * pitch
        return found.reshape(rows, columns), extent

    def contact_circle(self):
        """Centre and radius of a circle as large as the contact of the first tool; None where it touches
        nothing."""
        tool = self.run.tools[0] if self.run.tools else None
        history = tool and self.run.tool_history(tool)
        if not history or not history.rows or tool["shape"][0] not in ("sphere", "cone", "flat"):
            return None
        area = np.interp(
            self.particles.time, history["time"], history["contact_area"]
        ) / indentation.share_of_body(history)
        return (np.array(tool["tip"])[[self.a, self.b]], np.sqrt(area / np.pi)) if area > 0 else None


def surface(run, particles):
    """Height and one field of the surface, whole and near the contact."""
    top = Surface(run, particles)
    letter = "xyz"[top.up]
    if top.level is None:
        height, name = top.sign * top.top, f"{letter} of the surface"
    else:
        height, name = top.top - top.level, "height above the first surface"
    fields = [("height", name, height, "m")]
    if "plastic_strain" in particles.fields and np.any(particles["plastic_strain"] != 0):
        fields.append(("strain", "plastic strain", particles["plastic_strain"].reshape(-1), ""))
    fields.append(("stress", "von Mises stress", plots.von_mises(particles.smooth_stress()), "Pa"))
    factor, unit = plots.scaled("m", [top.whole[1] - top.whole[0], top.whole[3] - top.whole[2]])
    time_factor, time_unit = plots.scaled("s", [particles.time])
    place = f"seen along {letter} at {particles.time / time_factor:.4g} {time_unit}"
    circle = top.contact_circle()
    for view, words in reversed(list(zip(top.views, ("", ", near the contact")))):
        seen, extent = top.seen(view)
        for short, label, values, value_unit in fields:
            shown = np.where(seen >= 0, values[seen], np.nan)
            low, high = (
                np.nanpercentile(shown, [0.1, 99.9])
                if short != "height"
                else (np.nanmin(shown), np.nanmax(shown))
            )
            if high - low < least_range * max(abs(low), abs(high)):  # flat, to what is drawn of it
                low, high = (
                    0.5 * (low + high) + side * 0.5 * least_range * max(abs(low), abs(high))
                    for side in (-1, 1)
                )
            value_factor, scaled_unit = plots.scaled(value_unit, [low, high]) if value_unit else (1.0, "1")
            low, high = low / value_factor, high / value_factor
            figure, ax, colours = axes_for(view)
            diverging = (
                short == "height" and top.level is not None and min(-low, high) > 1e-3 * max(-low, high)
            )
            if diverging:  # pits and piles side by side, each to its own end
                range_ = dict(cmap="RdBu_r", norm=TwoSlopeNorm(0.0, low, high))
            else:
                range_ = dict(cmap="viridis", vmin=min(low, 0.0) if short != "height" else low, vmax=high)
            drawn = ax.imshow(
                shown / value_factor,
                origin="lower",
                extent=np.array(extent) / factor,
                interpolation="nearest",
                **range_,
            )
            for number, (lower, upper) in enumerate(particles.boxes[1:]):
                corners = [
                    (lower[top.a], lower[top.b]),
                    (upper[top.a], lower[top.b]),
                    (upper[top.a], upper[top.b]),
                    (lower[top.a], upper[top.b]),
                    (lower[top.a], lower[top.b]),
                ]
                ax.plot(
                    *(np.array(corners).T / factor),
                    color=plots.level_colors[number % len(plots.level_colors)],
                    linewidth=0.8,
                )
            if circle:
                ax.add_patch(
                    plt.Circle(
                        circle[0] / factor,
                        circle[1] / factor,
                        fill=False,
                        linestyle="--",
                        linewidth=1.0,
                        color="0.2",
                    )
                )
            ax.set(
                xlim=np.array(view[:2]) / factor,
                ylim=np.array(view[2:]) / factor,
                aspect="equal",
                xlabel=f"{'xyz'[top.a]} [{unit}]",
                ylabel=f"{'xyz'[top.b]} [{unit}]",
            )
            ax.grid(False)
            bar = figure.colorbar(
                drawn,
                cax=colours,
                label=f"{label} [{scaled_unit}]",
                orientation="horizontal",
                ticklocation="top",
                extend="neither" if short == "height" else "both",
                ticks=None if diverging else round_steps(5),
            )
            bar.ax.ticklabel_format(axis="x", useOffset=False)
            if diverging:  # each side has a scale of its own
                norm = drawn.norm
                bar.set_ticks(
                    [norm.vmin, 0.5 * norm.vmin, 0.0, 0.5 * norm.vmax, norm.vmax],
                    labels=[
                        f"{value:.3g}"
                        for value in (norm.vmin, 0.5 * norm.vmin, 0.0, 0.5 * norm.vmax, norm.vmax)
                    ],
                )
            circled = "; dashed: a circle of the contact area" if circle else ""
            yield picture(
                figure,
                f"surface-{short}{'-near' if words else ''}",
                f"surface {place}{words}: {label}, {values_text(low, high, 1.0, scaled_unit)}",
                f"{label[0].upper()}{label[1:]}{words}; {place}{circled}",
            )


# ---- histories, for readers without scripts
# ------------------------------------------------------------------------------------------------------------


def load_depth(run, tool, history, options):
    name = tool["name"][0]
    figure = plots.load_depth(run, tool, history, options)
    figure.set_layout_engine("constrained")
    return picture(
        figure,
        f"still-load-{name}",
        f"load on the tool {name} over its depth",
        f"Load on the tool {name} over its depth",
    )


def energies(run, history):
    return picture(
        plots.energies(run, history),
        "still-energy",
        "energies and balance error over time",
        "Energies and balance error over time",
    )
