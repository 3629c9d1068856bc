#!/usr/bin/env python3
"""Pictures of a run, written into its directory.

   plots.py [options] RUN

load_depth.png (or load_depth_NAME.png with several tools)  the load on the tool over its depth, for the full
               body, beside half-space theory for its shape and any --finite-elements reference
section.png    stress on a plane through the tool's axis, from the last particle file; the edges of levels as
thin lines
energy.png     the energies over time
time_per_step.png   of the thesis's E1: this run among measured and modelled times over ranks

   --finite-elements FILE.csv   a reference curve (may be repeated)
   --no-theory                  without the half-space curve
   --snapshot FILE.hdf          another particle file for the section

What a run did not write is not drawn; exit status 1 if there was nothing to draw.
"""

import argparse
import os
import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from . import indentation
from . import tool_surface
from .atoms_section import atoms_beside
from .run_data import (
    History,
    Particles,
    Unreadable,
    carried,
    read_namelists,
    snapshot_paths,
    time_of_snapshot,
)

plt.rcParams.update(
    {
        "figure.dpi": 150,
        "font.size": 9,
        "axes.titlesize": 10,
        "axes.grid": True,
        "grid.color": "0.9",
        "grid.linewidth": 0.6,
        "axes.axisbelow": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "legend.frameon": False,
        "lines.linewidth": 1.4,
    }
)

prefixes = [
    (1e-12, "p"),
    (1e-9, "n"),
    (1e-6, "\N{MICRO SIGN}"),
    (1e-3, "m"),
    (1.0, ""),
    (1e3, "k"),
    (1e6, "M"),
    (1e9, "G"),
]


level_colors = ["C3", "C1", "C6", "C9", "0.6"]  # stand out from the colours of the stress


def scaled(unit, *arrays):
    """The factor and the unit with the prefix that suit the largest finite magnitude: (1e-9, 'nm')."""
    finite = [np.abs(a[np.isfinite(a)]) for a in map(np.asarray, arrays)]
    largest = max((a.max() for a in finite if a.size), default=0.0)
    factor, prefix = next(
        ((f, p) for f, p in reversed(prefixes) if largest >= f), (1.0, "") if largest == 0 else prefixes[0]
    )
    return factor, prefix + unit


def save(figure, path):
    """Written under another name and renamed: a picture is complete or not there."""
    partial = path.with_name(f".{path.name}.part")
    figure.savefig(partial, format="png", bbox_inches="tight")
    os.replace(partial, path)
    plt.close(figure)
    print(path)


class Run:
    """The directory of a run and what it says about itself."""

    def __init__(self, directory, case=None):
        self.directory = directory
        if case is None:
            case = read_namelists(directory / "case.nml") if (directory / "case.nml").is_file() else {}
        self.case = case
        self.tools = self.case.get("tool", [])

    @property
    def title(self):
        title = (self.case.get("scene", [{}])[0].get("title") or [self.directory.name])[0]
        word = self.case.get("grid", [{}])[0].get("geometry", ["3d"])[0].lower().replace("_", " ")
        if word != "3d" and word not in title.lower():
            title += f" ({word})"
        return title.replace("$", r"\$")  # a title is no formula

    def tool_history(self, tool):
        path = self.directory / f"tool_{tool['name'][0]}.dat"
        return History(path) if path.is_file() else None


# ---- load over depth
# ------------------------------------------------------------------------------------------------------------


def own_references(run):
    """The finite elements that stand for a scene of the thesis, by the first word of its title (E2: ...)."""
    folder = Path(__file__).resolve().parents[2] / "test" / "references" / "fem"
    finest = {"E2:": "E2_cone_hypo_h0.024", "E3:": "E3_sphere_hypo_h0.15", "E4:": "E4_cone_hypo_h0.012"}
    path = folder / f"{finest.get(run.title.split(' ')[0], '-')}.csv"
    return [path] if path.is_file() else []


def draw_load_depth(run, options):
    drawn = False
    options.finite_elements = options.finite_elements or own_references(run)
    for tool in run.tools:
        history = run.tool_history(tool)
        if history is None or history.rows == 0:
            continue
        try:
            load_curve(run, tool, history)
        except Unreadable as error:
            print(f"no load over depth: {error}", file=sys.stderr)
            continue
        say_load(run, tool, history, options)
        name = "load_depth.png" if len(run.tools) == 1 else f"load_depth_{tool['name'][0]}.png"
        save(load_depth(run, tool, history, options), run.directory / name)
        drawn = True
    return drawn


def load_curve(run, tool, history):
    """Depth from first touch (m) and load against the tool's way (N), both of the full body, and the modelled
    share of it."""
    share = indentation.share_of_body(history)
    _, gap = indentation.indented_body(run.case, tool, history)
    depth = history["depth"] - gap
    load = (
        -sum(
            history[f"load_{axis}"] * direction for axis, direction in zip("xyz", indentation.unit_axis(tool))
        )
        / share
    )
    return depth, load, share


def reference_curves(run, tool, history, depth, load, options):
    """What the load is compared with: for each its label, depth (m), load (N), style, and how far the run is
    from it (`distance`)."""
    curves = []
    smooth = np.linspace(0, max(np.nanmax(depth), 0), 300)
    theory = None if options.no_theory else indentation.half_space_theory(run.case, tool, history)
    if theory:
        curves.append(
            (
                theory[0],
                smooth,
                theory[1](smooth),
                dict(color="0.45", linestyle="--"),
                distance(depth, load, theory[1]),
            )
        )
    for path in options.finite_elements:
        reference_depth, reference_load = indentation.read_reference(path)
        known = depth <= reference_depth[-1] * (1 + 1e-12)
        far = distance(
            depth[known],
            load[known],
            lambda d: np.interp(d, np.r_[0, reference_depth], np.r_[0, reference_load]),
        )
        shown = reference_depth <= smooth[-1] * 1.02
        curves.append(
            (
                f"finite elements ({path.stem})",
                reference_depth[shown],
                reference_load[shown],
                dict(color="C1", marker="o", markersize=3.5, linestyle="none"),
                far,
            )
        )
    return curves


def say_load(run, tool, history, options):
    """How far the load is from what it is compared with."""
    depth, load, _ = load_curve(run, tool, history)
    if not (np.all(np.isfinite(depth)) and np.all(np.isfinite(load))):
        print(f"warning: tool_{tool['name'][0]}.dat holds values that are not finite", file=sys.stderr)
    for label, *_, far in reference_curves(run, tool, history, depth, load, options):
        if far:
            print(f"load against {label}, second half of the depth: mean {far[0]:+.2%}, largest {far[1]:.2%}")


def load_depth(run, tool, history, options):
    """Depth from first touch, load against the tool's way: both of the full body."""
    depth, load, share = load_curve(run, tool, history)
    depth_factor, depth_unit = scaled("m", depth)
    load_factor, load_unit = scaled("N", load)
    figure, axes = plt.subplots(figsize=(5.6, 4.0))
    axes.plot(depth / depth_factor, load / load_factor, color="C0", label=f"gimp3d{model_text(share)}")
    for label, x, y, style, _ in reference_curves(run, tool, history, depth, load, options):
        axes.plot(x / depth_factor, y / load_factor, label=label, **style)
    flat = run.case["grid"][0].get("geometry", ["3d"])[0].lower() == "plane_strain"
    label = f"load per metre of width [{load_unit}/m]" if flat else f"load, full body [{load_unit}]"
    axes.set(xlabel=f"depth [{depth_unit}]", ylabel=label, title=run.title)
    axes.margins(x=0.02)
    axes.legend()
    return figure


def model_text(share):
    return {1.0: "", 0.5: ", half model x 2", 0.25: ", quarter model x 4"}.get(
        share, f", model x {1 / share:g}"
    )


def distance(depth, load, reference):
    """How far the load is from a curve over the second half of the depth range, while the tool goes in: mean
    and largest share of the curve; None where it does not go in."""
    if depth.size == 0 or np.max(depth) <= 0:
        return None
    inwards = np.arange(depth.size) <= np.argmax(depth)
    far = inwards & (depth >= np.max(depth) / 2)
    share = load[far] / reference(depth[far]) - 1
    return np.mean(share), np.max(np.abs(share))


# ---- stress section
# ------------------------------------------------------------------------------------------------------------


def von_mises(stress):
    """From the six components, normal ones first."""
    xx, yy, zz = stress[:, 0], stress[:, 1], stress[:, 2]
    return np.sqrt(
        0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3 * np.sum(stress[:, 3:] ** 2, axis=1)
    )


def section_plane(run):
    """Indices of the plane's horizontal, vertical and normal directions, and a point of it."""
    if not run.tools:
        grid = run.case["grid"][0]
        point = 0.5 * (np.array(grid["lower"]) + np.array(grid["upper"]))
        sides = grid.get("boundary", ["free"])
        if len(sides) == 6 and "symmetry" in sides[2:4]:  # the middle of the whole
            point[1] = grid["lower" if sides[2] == "symmetry" else "upper"][1]
        return 0, 2, 1, point
    vertical = int(np.argmax(np.abs(indentation.unit_axis(run.tools[0]))))
    horizontal, normal = [i for i in (0, 1, 2) if i != vertical]
    return horizontal, vertical, normal, np.array(run.tools[0]["tip"])


def layer(particles, normal, plane):
    """The one layer of particles that begins at the plane (the one below where the body ends at it)."""
    offset = (particles["position"][:, normal] - plane) / (2 * half_sizes(particles)[:, normal])
    for first in (0, -1):
        chosen = (offset >= first) & (offset < first + 1)
        if np.any(chosen):
            return chosen
    return np.abs(offset) <= np.min(np.abs(offset)) + 1


def half_sizes(particles):
    """Of the box around each particle's domain, along the axes."""
    if "domain" in particles.fields:  # half edges
        return np.abs(particles["domain"].reshape(-1, 3, 3)).sum(axis=1)
    size = particles["half_size"].reshape(particles.ids.size, -1)
    return np.broadcast_to(size, (particles.ids.size, 3))


class Section:
    """The layer of particles on the section plane, what is drawn of it (`panels`: label and values of the
    layer) and from how near (`views`: limits; the whole, and a close-up of the contact where that is much
    smaller)."""

    def __init__(self, run, particles):
        self.run, self.particles = run, particles
        self.across, self.up, self.normal, self.point = section_plane(run)
        across, up = self.across, self.up
        chosen = layer(particles, self.normal, self.point[self.normal])
        position, half = particles["position"][chosen], half_sizes(particles)[chosen]
        self.x, self.z = x, z = position[:, across], position[:, up]
        self.dx, self.dz = dx, dz = half[:, across], half[:, up]
        stress = particles.smooth_stress()[chosen]
        self.panels = [
            (f"$\\sigma_{{{2 * 'xyz'[up]}}}$", stress[:, up], "Pa"),
            ("von Mises stress", von_mises(stress), "Pa"),
        ]
        self.atoms = atoms_beside(run, particles, across, up, self.normal, self.point[self.normal])
        self.more = [
            (name.replace("_", " "), particles[name][chosen].reshape(-1), unit)
            for name, unit in (("plastic_strain", ""), ("temperature", "K"))
            if name in particles.fields and np.any(particles[name] != 0)
        ]
        whole = [np.min(x - dx), np.max(x + dx), np.min(z - dz), np.max(z + dz)]
        if run.tools:  # some room for the tool
            room = 0.08 * (whole[3] - whole[2])
            down = indentation.unit_axis(run.tools[0])[up] < 0
            whole = whole[:2] + ([whole[2], whole[3] + room] if down else [whole[2] - room, whole[3]])
        close = close_up(run, particles, whole, self.point[[across, up]], across, up)
        self.views = [whole] if close is None else [whole, close]
        self.factor, self.unit = scaled("m", [whole[1] - whole[0], whole[3] - whole[2]])
        self.squares = np.stack(
            [np.stack([x + i * dx, z + k * dz], axis=1) for i, k in ((-1, -1), (1, -1), (1, 1), (-1, 1))],
            axis=1,
        )

    def limits(self, values, of_atoms=None):
        """Range of the part that matters, without the few extremes at the rim of the contact; 0 belongs to
        it."""
        left, right, bottom, top = self.views[-1]
        near = (self.x >= left) & (self.x <= right) & (self.z >= bottom) & (self.z <= top)
        low, high = np.nanpercentile(np.r_[values[near], 0.0], [0.2, 99.8])
        if of_atoms is not None:  # a surface of atoms has stresses of its own
            least, most = np.nanpercentile(of_atoms, [5, 95])
            low, high = min(low, least), max(high, most)
        return min(low, 0.0), max(high, 0.0)

    def atoms_values(self, label):
        """Of the atoms, what a panel shows (Pa); None where it is no stress or there are no atoms."""
        if self.atoms is None or label not in (self.panels[0][0], self.panels[1][0]):
            return None
        stress = self.atoms.stress
        return stress[:, self.up] if label == self.panels[0][0] else von_mises(stress)

    def draw(self, ax, values, unit, view, of_atoms=None):
        """One panel, with values of atoms where there are some; returns what a colour bar needs, the unit with
        its prefix, and the lines of levels."""
        across, up, normal, factor = self.across, self.up, self.normal, self.factor
        low, high = self.limits(values, of_atoms)
        value_factor, value_unit = scaled(unit, [low, high]) if unit == "Pa" else (1.0, unit)
        # edges cover hairlines
        drawn = PolyCollection(
            self.squares / factor,
            array=values / value_factor,
            cmap="viridis",
            edgecolors="face",
            linewidths=0.8,
        )
        drawn.set_clim(low / value_factor, high / value_factor)
        drawn.set_rasterized(True)
        ax.add_collection(drawn)
        if of_atoms is not None:
            self.atoms.draw(ax, of_atoms, drawn, factor, value_factor)
        edges = draw_levels(ax, self.particles, self.point, (across, up, normal), self.views[0], factor)
        draw_tools(self.run, ax, self.particles.time, across, up, factor)
        draw_cut_tools(self.run, ax, self.particles.time, (across, up, normal), self.point[normal], factor)
        ax.set(
            xlim=np.array(view[:2]) / factor,
            ylim=np.array(view[2:]) / factor,
            aspect="equal",
            xlabel=f"{'xyz'[across]} [{self.unit}]",
            ylabel=f"{'xyz'[up]} [{self.unit}]",
        )
        ax.grid(False)
        return drawn, value_unit, edges

    @property
    def place(self):
        """Where and when, in words."""
        time_factor, time_unit = scaled("s", [self.particles.time])
        return (
            f"section {'xyz'[self.normal]} = {self.point[self.normal] / self.factor:.4g} {self.unit} "
            f"at {self.particles.time / time_factor:.4g} {time_unit}"
        )


def last_particles(run, options):
    """The snapshot that is drawn; None where there is none, or nothing in it."""
    snapshots = snapshot_paths(run.directory)
    if options.snapshot is None and not snapshots:
        return None
    particles = Particles(options.snapshot or at_largest_load(run, snapshots))
    return particles if particles.ids.size else None


def at_largest_load(run, snapshots):
    """The snapshot at which the load of the first tool that bears one is largest: afterwards waves run about.
    The last one where there is none."""
    for tool in run.tools:
        history = run.tool_history(tool)
        if history is None or history.rows == 0:
            continue
        load = -sum(history[f"load_{a}"] * d for a, d in zip("xyz", indentation.unit_axis(tool)))
        if not np.all(np.isfinite(load)) or not load.max() > 0:
            continue
        at_snapshots = [np.interp(time_of_snapshot(path), history["time"], load) for path in snapshots]
        if max(at_snapshots) > 0:
            return snapshots[int(np.argmax(at_snapshots))]
    return snapshots[-1]


def draw_section(run, options):
    particles = last_particles(run, options)
    if particles is None:
        return False
    section = Section(run, particles)
    views = section.views
    heights = [min(max(4.0 * (view[3] - view[2]) / (view[1] - view[0]), 1.8), 6.0) for view in views]
    figure, axes = plt.subplots(
        len(views),
        2,
        squeeze=False,
        layout="constrained",
        figsize=(9.0, 1.4 + sum(heights)),
        height_ratios=heights,
    )
    for column, (label, values, unit) in enumerate(section.panels):
        for row, view in enumerate(views):
            drawn, value_unit, edges = section.draw(
                axes[row][column], values, unit, view, section.atoms_values(label)
            )
        figure.colorbar(
            drawn,
            ax=axes[:, column],
            label=f"{label} [{value_unit}]",
            extend="both",
            location="top",
            shrink=0.8,
            aspect=40,
        )
    if edges:
        figure.legend(handles=edges, loc="outside lower center", ncols=len(edges))
    figure.suptitle(f"{run.title}\n{section.place}", fontsize=10)
    save(figure, run.directory / "section.png")
    return True


def draw_levels(ax, particles, point, axes, whole, factor):
    """Where the plane cuts the sides of the boxes of levels in the coarsest one; returns the lines, for the
    legend, of those that pass through the whole section."""
    across, up, normal = axes
    lines = []
    for n, (low, high) in enumerate(particles.boxes[1:], 2):
        if not low[normal] <= point[normal] <= high[normal]:
            continue
        left, right, bottom, top = low[across], high[across], low[up], high[up]
        label = f"level {n}: cells of {length_text(particles.cells[n - 1])}"
        line = ax.plot(
            np.array([left, right, right, left, left]) / factor,
            np.array([bottom, bottom, top, top, bottom]) / factor,
            color=level_colors[(n - 2) % len(level_colors)],
            linewidth=0.8,
            label=label,
        )
        apart = right < whole[0] or left > whole[1] or top < whole[2] or bottom > whole[3]
        around = left < whole[0] and right > whole[1] and bottom < whole[2] and top > whole[3]
        if not (apart or around):
            lines += line
    return lines


def length_text(length):
    factor, unit = scaled("m", [length])
    return f"{length / factor:.4g} {unit}"


def close_up(run, particles, whole, tip, across, up):
    """Limits around the contact, or None when the whole section is not much larger."""
    if not run.tools:
        return None
    tool = run.tools[0]
    history = run.tool_history(tool)
    if history is None or history.rows == 0:
        return None
    cell = particles.cells[-1] if particles.cells.size else run.case["grid"][0]["cell_size"][0]
    time = particles.time
    area = np.interp(time, history["time"], history["contact_area"]) / indentation.share_of_body(history)
    reach = max(2.5 * np.sqrt(max(area, 0.0) / np.pi), 6 * cell)
    if not 2 * reach < 0.6 * (whole[1] - whole[0]):
        return None
    inwards = np.sign(indentation.unit_axis(tool)[up])
    now = where(tool, history, time, np.array([tool["tip"]]))[0]
    tip = now[across], now[up]
    top = tip[1] - inwards * 0.25 * reach
    bottom = top + inwards * 1.25 * reach
    left = min(max(whole[0], tip[0] - reach), whole[1] - 2 * reach)
    return [left, left + 2 * reach, min(top, bottom), max(top, bottom)]


def where(tool, history, time, places):
    """Where places of a tool's outline (n x 3, m, as at the start) are at a time. Round tools look the same
    however they turn."""
    axis = indentation.unit_axis(tool)
    if tool["shape"][0] not in ("sphere", "cylinder"):
        return carried(history, axis, time, places)
    middle = np.array([tool["tip"]]) - tool["radius"][0] * axis
    return places + carried(history, axis, time, middle) - middle


def draw_tools(run, ax, time, across, up, factor):
    for tool in run.tools:
        axis, tip = indentation.unit_axis(tool), np.array(tool["tip"])
        if abs(axis[up]) < 0.999:
            continue
        edge = np.array(tool.get("edge", [1.0, 0.0, 0.0]))
        round_here = tool["shape"][0] == "cylinder" and abs(edge[3 - across - up]) > 0.999 * np.linalg.norm(
            edge
        )
        outline = indentation.tool_outline(
            dict(tool, shape=["sphere"]) if round_here else tool, 1e3 * run.case["grid"][0]["cell_size"][0]
        )
        if outline is None:
            continue
        history = run.tool_history(tool)
        for side in (-1, 1):
            places = np.tile(tip, (len(outline[0]), 1))
            places[:, across] += side * outline[0]
            places[:, up] -= np.sign(axis[up]) * outline[1]
            if history is not None and history.rows > 0:
                places = where(tool, history, time, places)
            ax.plot(places[:, across] / factor, places[:, up] / factor, color="0.25", linewidth=1.0)


def draw_cut_tools(run, ax, time, axes, plane, factor):
    """Tools of which no profile is known in the section: where the plane cuts their triangles."""
    across, up, normal = axes
    for tool in run.tools:
        known = indentation.tool_outline(tool, 1.0) is not None
        if known and abs(indentation.unit_axis(tool)[up]) >= 0.999:
            continue
        for _, axis, found, history in tool_surface.tools_of(
            run.directory, {"tool": [tool]}, tool_surface.reach_of(run.case)
        ):
            there = carried(history, axis, time, found.reshape(-1, 3)).reshape(-1, 3, 3)
            lines = tool_surface.section(there, normal, plane)[:, :, [across, up]] / factor
            ax.add_collection(LineCollection(lines, colors="0.25", linewidths=1.0), autolim=False)


# ---- energies
# ------------------------------------------------------------------------------------------------------------


def draw_energy(run, options):
    path = run.directory / "energy.dat"
    history = History(path) if path.is_file() else None
    if history is None or history.rows == 0:
        return False
    save(energies(run, history), run.directory / "energy.png")
    return True


def energies(run, history):
    """All energies (J) over time, and the balance error below."""
    kinds = [name for name, unit in history.units.items() if unit == "J"]
    errors = ["balance_error"] if "balance_error" in history.columns else []
    time_factor, time_unit = scaled("s", history["time"])
    factor, unit = scaled("J", *(history[name] for name in kinds))
    figure, axes = plt.subplots(
        2 if errors else 1,
        1,
        squeeze=False,
        sharex=True,
        figsize=(5.6, 4.8 if errors else 3.6),
        layout="constrained",
        height_ratios=[3, 1][: 2 if errors else 1],
    )
    shown = [name for name in kinds if np.any(history[name] != 0)]
    shown.sort(key=lambda name: -np.nanmax(np.abs(history[name])))
    for number, name in enumerate(shown):  # the larger ones wide and below: none hides another
        axes[0][0].plot(
            history["time"] / time_factor,
            history[name] / factor,
            label=name.replace("_", " "),
            linewidth=max(1.0, 4.5 - 1.2 * number),
            alpha=0.55 if number < 2 else 1.0,
        )
    axes[0][0].set(ylabel=f"energy [{unit}]", title=run.title)
    axes[0][0].legend()
    if errors:
        # Relative to the largest energy so far: while nothing has moved yet it says nothing
        error = 100 * history["balance_error"]
        axes[1][0].plot(history["time"] / time_factor, error, color="C3")
        largest = np.nanmax(np.abs(error[error.size // 5 :]))
        axes[1][0].set(ylabel="balance error [%]", ylim=(-1.2 * largest or -1.0, 1.2 * largest or 1.0))
    axes[-1][0].set(xlabel=f"time [{time_unit}]")
    figure.align_ylabels()
    return figure


# ---- time per step over ranks
# ------------------------------------------------------------------------------------------------------------


def draw_time_per_step(run, options):
    """The thesis's figure 17: what `make bench BENCH=ranks` has found, and this run."""
    stored = Path(__file__).resolve().parents[2] / "test" / "references" / "time_per_step.csv"
    costs = run.directory / "cost.dat"
    if run.title.split(" ")[0] != "E1:" or not stored.is_file() or not costs.is_file():
        return False
    table = np.genfromtxt(stored, delimiter=",", names=True)
    facts = dict(re.findall(r'^AUXDATA (\w+)="([^"]*)"', costs.read_text(), re.M))
    million = float(facts["particles_at_start"]) / 1e6
    mine = 1e3 * float(facts["elapsed_s"]) / float(facts["steps"]) / million
    figure, axes = plt.subplots(figsize=(5.0, 3.6), layout="constrained")
    each = table["particles"] / 1e6
    model, measured = table["model_ms"] / each, table["measured_ms"] / each
    seen = np.isfinite(measured) & (table["ranks"] > 1)
    off = np.mean(model[seen] / measured[seen] - 1)  # messages are counted, waiting is not
    beyond = table["ranks"] > 1
    label = f"model, 8 a cell ({100 * off:+.1f} % off where measured)"
    axes.loglog(table["ranks"], model, "o-", color="C0", ms=3, label=label)
    axes.fill_between(table["ranks"][beyond], model[beyond], model[beyond] / (1 + off), color="C0", alpha=0.3)
    axes.loglog(table["ranks"], measured, "s", color="C3", label="measured, 8 a cell")
    axes.loglog([float(facts["ranks"])], [mine], "D", color="C2", label="this run")
    axes.set(xlabel="ranks", ylabel="time per step and million particles [ms]", title=run.title)
    axes.set_xticks(table["ranks"], [f"{ranks:.0f}" for ranks in table["ranks"]], minor=False)
    axes.minorticks_off()
    axes.legend()
    save(figure, run.directory / "time_per_step.png")
    return True


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--finite-elements", type=Path, action="append", default=[])
    parser.add_argument("--no-theory", action="store_true")
    parser.add_argument("--snapshot", type=Path)
    options = parser.parse_args()
    try:
        if not options.run.is_dir():
            raise Unreadable(f"{options.run}: no such directory")
        run = Run(options.run)
        drawers = (draw_load_depth, draw_section, draw_energy, draw_time_per_step)
        drawn = [draw(run, options) for draw in drawers]
    except Unreadable as error:
        print(error, file=sys.stderr)
        return 1
    except (KeyError, IndexError) as error:
        print(f"{options.run}: what the run wrote lacks {error}", file=sys.stderr)
        return 1
    if not any(drawn):
        print(f"{options.run}: nothing to draw", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
