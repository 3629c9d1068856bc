"""The pictures of hardness.py: load over depth with the fits, the surface, the pressure under the tip,
numbers over depth."""

import math

import numpy as np

from . import imprint
from .plots import plt, save, scaled


def draw_load_depth(run, record, answer, results, path):
    depth_factor, depth_unit = scaled("m", record.depth)
    load_factor, load_unit = scaled("N", record.load)
    figure, axes = plt.subplots(figsize=(5.6, 4.0))
    axes.plot(record.depth / depth_factor, record.load / load_factor, color="C0", label="gimp3d, full body")
    row = int(np.argmax(record.depth))
    sharp = record.tool["shape"][0] in ("cone", "berkovich", "pyramid")  # others follow no parabola
    if sharp and answer["loading_curvature"] is not None:
        h = np.linspace(0, record.depth[row], 200)
        axes.plot(
            h / depth_factor,
            answer["loading_curvature"] * h**2 / load_factor,
            color="0.45",
            linestyle="--",
            label="$C h^2$",
        )
    for number, (unloading, result, _) in enumerate(results):
        fit = result.fit
        h = np.linspace(fit.residual_depth, fit.depth, 200)
        axes.plot(
            h / depth_factor,
            fit.load(h) / load_factor,
            color="C1",
            linewidth=1.0,
            label="$a\\,(h-h_f)^m$" if number == 0 else None,
        )
        top, foot = result.values["max_load"], fit.depth - result.values["max_load"] / fit.stiffness
        axes.plot(
            np.array([foot, fit.depth]) / depth_factor,
            np.array([0, top]) / load_factor,
            color="C3",
            linestyle=":",
            label="slope $S$" if number == 0 else None,
        )
    axes.set(xlabel=f"depth [{depth_unit}]", ylabel=f"load, full body [{load_unit}]", title=run.title)
    axes.margins(x=0.02)
    axes.legend()
    save(figure, path)


def draw_profile(run, record, pictures, path):
    """Lines through and across the imprint, and the means of rings."""
    colors = {"loaded": "C0", "unloaded": "C1"}
    reach = 0.75 * max(profile.radius[-1] for _, _, _, profile in pictures.values())
    factor, unit = scaled("m", [reach])
    high_factor, high_unit = scaled(
        "m", *(surface.heights[surface.radii < reach] for _, _, surface, _ in pictures.values())
    )
    distance = np.linspace(-reach, reach, 401)
    figure, axes = plt.subplots(3, 1, figsize=(6.0, 7.6), layout="constrained", sharex=True)
    for ax, direction, label in zip(axes, ((1.0, 0.0), (0.0, 1.0)), ("through", "across")):
        for name, (time, depth, surface, _) in pictures.items():
            heights = imprint.line(surface, direction, distance)
            ax.plot(distance / factor, heights / high_factor, color=colors[name], label=name)
            tool = (
                imprint.tool_height(record.tool, np.outer(distance, direction)) if name == "loaded" else None
            )
            if tool is not None:
                shown = tool - depth < max(0.15 * depth, 1.2 * float(surface.heights.max()))
                ax.plot(
                    distance[shown] / factor,
                    (tool[shown] - depth) / high_factor,
                    color="0.25",
                    linewidth=0.8,
                    label="tool",
                )
        ax.set(ylabel=f"height, {label} [{high_unit}]")
        ax.legend()
    for name, (_, _, _, profile) in pictures.items():
        for side in (-1, 1):
            axes[2].plot(
                side * profile.radius / factor,
                profile.mean / high_factor,
                color=colors[name],
                label=name if side > 0 else None,
            )
            axes[2].fill_between(
                side * profile.radius / factor,
                profile.lowest / high_factor,
                profile.highest / high_factor,
                color=colors[name],
                alpha=0.2,
                linewidth=0,
            )
    axes[2].set(
        xlabel=f"distance from the axis [{unit}]",
        ylabel=f"height, rings [{high_unit}]",
        xlim=(-reach / factor, reach / factor),
    )
    axes[0].set_title(run.title)
    save(figure, path)


def draw_pressure(run, record, answer, picture, path):
    _, _, surface, profile = picture
    edge = math.sqrt(
        (answer.get("area_profile") or answer["area_true"] or surface.radii.max() ** 2) / math.pi
    )
    near = surface.radii < 2 * edge
    factor, unit = scaled("m", [2 * edge])
    value_factor, value_unit = scaled("Pa", profile.stress)
    figure, axes = plt.subplots(figsize=(5.6, 4.0))
    axes.plot(
        surface.radii[near] / factor,
        surface.stress[near] / value_factor,
        ".",
        color="0.7",
        markersize=3,
        label="normal stress of single particles: noise of the grid",
    )
    inside = profile.radius < 2 * edge
    axes.plot(
        profile.radius[inside] / factor,
        profile.stress[inside] / value_factor,
        color="C0",
        marker="o",
        markersize=3,
        label="normal stress, rings",
    )
    axes.plot(
        profile.radius[inside] / factor,
        profile.contact[inside] / value_factor,
        color="C1",
        marker="s",
        markersize=3,
        linewidth=0.8,
        label="contact pressure, rings",
    )
    axes.axvline(edge / factor, color="0.6", linewidth=0.8, linestyle=":", label="edge of the contact")
    if answer["hardness_true"]:
        axes.axhline(
            answer["hardness_true"] / value_factor, color="0.45", linestyle="--", label="hardness, true area"
        )
    axes.set(
        xlabel=f"distance from the axis [{unit}]",
        ylabel=f"pressure under the tip [{value_unit}]",
        title=run.title,
    )
    axes.legend()
    save(figure, path)


def draw_over_depth(run, answer, path):
    rows = answer["unloadings"]
    figure, panels = plt.subplots(2, 1, figsize=(5.6, 5.6), layout="constrained", sharex=True)
    factor, unit = scaled("m", [row["max_depth"] for row in rows])
    for ax, quantity, name in zip(panels, ("hardness", "modulus"), ("hardness", "$E_r$")):
        found = [
            row[f"{quantity}_{kind}"]
            for row in rows
            for kind in ("oliver_pharr", "true")
            if row.get(f"{quantity}_{kind}")
        ]
        value_factor, value_unit = scaled("Pa", found)
        for kind, label, color in (("oliver_pharr", "Oliver-Pharr area", "C1"), ("true", "true area", "C0")):
            known = [row for row in rows if row.get(f"{quantity}_{kind}") is not None]
            ax.errorbar(
                [row["max_depth"] / factor for row in known],
                [row[f"{quantity}_{kind}"] / value_factor for row in known],
                yerr=[(row.get(f"{quantity}_{kind}_uncertainty") or 0.0) / value_factor for row in known],
                color=color,
                marker="o",
                markersize=4,
                capsize=2,
                label=label,
            )
        ax.set(ylabel=f"{name} [{value_unit}]", ylim=(0, None))
        ax.legend()
    panels[0].set_title(run.title)
    panels[1].set_xlabel(f"depth [{unit}]")
    save(figure, path)
