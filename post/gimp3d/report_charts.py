"""The data of a report's charts, as report.js takes them."""

import numpy as np

from . import indentation
from . import plots
from .run_data import Unreadable

most_rows = 2000  # of a curve in the page
digits = 6  # of a number there


def chosen_rows(values):
    """Row numbers of a curve in the page: all, or of each stretch of rows its first, lowest and highest."""
    rows = len(values)
    if rows <= most_rows:
        return np.arange(rows)
    kept = {0, rows - 1}
    for stretch in np.array_split(np.arange(rows), most_rows // 3):
        known = stretch[np.isfinite(values[stretch])]
        kept.add(int(stretch[0]))
        if known.size:
            kept |= {int(known[np.argmin(values[known])]), int(known[np.argmax(values[known])])}
    return np.array(sorted(kept))


def listed(values):
    """Numbers for JSON; what is not finite is null."""
    return [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values]


def axis(name, unit, values):
    return {"name": name, "unit": unit, "values": listed(values)}


def chart(name, title, axes, views):
    return {"id": f"chart-{name}", "title": title, "axes": axes, "views": views}


def tool(run, one, history, options):
    """Load, contact area and overlap of a tool over its depth and over time; beside theory and references.
    Also the sentences that say how far the load is from these, and what could not be had."""
    name, words = one["name"][0], []
    axis_text = "depth"
    try:
        depth, load, share = plots.load_curve(run, one, history)
        references = plots.reference_curves(run, one, history, depth, load, options)
    except Unreadable as error:
        share = indentation.share_of_body(history)
        depth, references = history["depth"], []
        load = -sum(history[f"load_{a}"] * d for a, d in zip("xyz", indentation.unit_axis(one))) / share
        axis_text = "travel"
        words.append(f"The depth is the travel of the tool {name}: {error}.")
    rows = chosen_rows(load)
    model = plots.model_text(share)
    time = axis("time", "s", history["time"][rows])
    moves = depth.size and np.ptp(depth[np.isfinite(depth)]) > 0 if np.any(np.isfinite(depth)) else False
    axes = [axis(axis_text, "m", depth[rows]), time] if moves else [time]
    loads = [{"name": f"gimp3d{model}", "y": listed(load[rows])}]
    for label, x, y, style, far in references if moves else []:
        loads.append(
            {
                "name": label,
                "x": listed(x),
                "y": listed(y),
                "axis": 0,
                "mark": "points" if "marker" in style else "dashed",
            }
        )
        if far:
            words.append(
                f"Load on {name} against {label}, second half of the depth: mean {far[0]:+.2%}, largest "
                f"{far[1]:.2%}."
            )
    views = [{"name": "load, full body", "unit": "N", "series": loads}]
    if share == 1:
        across = [(f"load_{a}", history[f"load_{a}"]) for a in "xyz"]
        views.append(
            {
                "name": "load by components",
                "unit": "N",
                "series": [
                    {"name": label.replace("_", " "), "y": listed(values[rows])} for label, values in across
                ],
            }
        )
    views.append(
        {
            "name": "contact area, full body",
            "unit": "m2",
            "series": [{"name": f"gimp3d{model}", "y": listed(history["contact_area"][rows] / share)}],
        }
    )
    views.append(
        {
            "name": "overlap",
            "unit": "m",
            "series": [
                {"name": "deepest overlap with the tool", "y": listed(history["max_gap_violation"][rows])}
            ],
        }
    )
    return chart(f"tool-{name}", f"Tool {name}: load", axes, views), words


def profile(path, tool):
    """Height of the surface and pressure under the tool over the distance from its axis, from
    hardness_profile.csv (nm, GPa)."""
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, ndmin=2)
    if rows.ndim != 2 or rows.shape[1] != 7:
        raise Unreadable(f"{path} has not the columns of a profile")
    loaded, unloaded = (rows[rows[:, 0] == which] for which in (0, 1))
    first = loaded if len(loaded) else unloaded
    distance = axis("distance from the axis", "m", 1e-9 * first[:, 1])

    def series(name, part, values):
        own = {} if part is first else {"x": listed(1e-9 * part[:, 1]), "axis": 0}
        return {"name": name, **own, "y": listed(values)}

    parts = [(name, part) for name, part in (("loaded", loaded), ("unloaded", unloaded)) if len(part)]
    views = [
        {
            "name": "height",
            "unit": "m",
            "series": [series(name, part, 1e-9 * part[:, 2]) for name, part in parts],
        }
    ]
    if len(loaded):
        pressures = [("normal stress", 5), ("contact pressure", 6)]
        views.append(
            {
                "name": "pressure",
                "unit": "Pa",
                "series": [series(name, loaded, 1e9 * loaded[:, column]) for name, column in pressures],
            }
        )
    return chart(f"profile-{tool}", "Profile of the imprint", [distance], views)


def energies(history):
    """All energies, and the balance error in per cent."""
    rows = chosen_rows(sum(np.abs(history[name]) for name, unit in history.units.items() if unit == "J"))
    kinds = [name for name, unit in history.units.items() if unit == "J" and np.any(history[name] != 0)]
    views = [
        {
            "name": "energy",
            "unit": "J",
            "series": [{"name": name.replace("_", " "), "y": listed(history[name][rows])} for name in kinds],
        }
    ]
    if "balance_error" in history.columns:
        views.append(
            {
                "name": "balance error",
                "unit": "%",
                "series": [
                    {
                        "name": "of the largest energy or work so far",
                        "y": listed(100 * history["balance_error"][rows]),
                    }
                ],
            }
        )
    return chart(
        "energy",
        "Energies",
        [axis("time", "s", history["time"][rows])],
        [view for view in views if view["series"]],
    )


def probes(histories):
    """Stress, plastic strain and way of all probes (name -> History), one curve each."""
    first = next(iter(histories.values()))
    rows = chosen_rows(first["von_mises"])
    time = listed(first["time"][rows])

    def view(name, unit, of):
        """A view of one quantity, of(history) -> its values; a probe with rows of its own brings its
        times."""
        series = []
        for probe, history in histories.items():
            if np.array_equal(history["time"], first["time"]):
                series.append({"name": probe, "y": listed(of(history)[rows])})
            else:
                own = chosen_rows(history["von_mises"])
                series.append(
                    {
                        "name": probe,
                        "x": listed(history["time"][own]),
                        "y": listed(of(history)[own]),
                        "axis": 0,
                    }
                )
        return {"name": name, "unit": unit, "series": series}

    views = [view("von Mises stress", "Pa", lambda history: history["von_mises"])]
    views += [
        view(column.replace("_", " "), "Pa", lambda history, column=column: history[column])
        for column in first.columns
        if column.startswith("stress_")
    ]
    if any(np.any(history["equivalent_plastic_strain"] != 0) for history in histories.values()):
        views.append(
            view("equivalent plastic strain", "1", lambda history: history["equivalent_plastic_strain"])
        )
    views += [
        view(f"way along {letter}", "m", lambda history, letter=letter: history[letter] - history[letter][0])
        for letter in "xyz"
    ]
    return chart("probes", "Probes", [{"name": "time", "unit": "s", "values": time}], views)
