#!/usr/bin/env python3
"""Evaluation of an indentation run like that of an instrument's record (doc/user/hardness.md):

   hardness.py [options] RUN

loading curvature, fit of the unloading, stiffness, contact depth, the area of Oliver and Pharr, hardness and
modulus from it and from the true area, work ratio, pile-up. A table on the terminal, and in the run's
directory (with _NAME before the dot for one of several tools)

hardness.json               all numbers, SI units, each with its uncertainty
hardness.csv                time [s], depth [nm], load [mN] of the full body, for spreadsheets
hardness.hld                the same in an instrument's format (nm, uN, s), for micromechanics and nanodent
hardness_profile.csv        the surface in rings about the axis, at the largest depth and unloaded
hardness_load_depth.png, hardness_profile.png, hardness_pressure.png
hardness_depth.csv, .png    hardness and modulus over depth, with several unloadings

   --tool NAME               required if there are several tools
   --window 20,98            range of the load for the fit of the unloading, in per cent
   --epsilon NUMBER          factor of the contact depth; default: from the fitted exponent
   --beta NUMBER             factor of the modulus; default by the shape of the tool: Hay's factor for a cone,
                             1.034 for a Berkovich, 1.012 for a Vickers, else 1
   --area-coefficients LIST  C0,C1,... of an area function in nm, in place of the ideal one of the tool
   --area auto|column|profile   the true area: contact_area of the history, or from the profile; auto uses
                             the profile if the history has no area
   --no-plots                only the table, .json and .csv

Exit status 2 if there is nothing to analyse; the message says what is missing.
"""

import argparse
import csv
import io
import json
import math
import os
import sys
from pathlib import Path

import numpy as np

from . import hardness_plots as pictures_of
from . import imprint
from . import indentation
from . import oliver_pharr
from .instrument_file import hld_text
from .plots import Run, scaled
from .run_data import History, Particles, Unreadable, depth_of, senseless, snapshot_paths, why
from .scene_text import is_flat
from . import systematic

keys = (
    "max_depth",
    "max_load",
    "loading_curvature",
    "stiffness",
    "residual_depth",
    "contact_depth",
    "area_oliver_pharr",
    "area_true",
    "hardness_oliver_pharr",
    "hardness_true",
    "modulus_oliver_pharr",
    "modulus_true",
    "work_ratio",
    "pile_up",
)
area_share = 0.2  # of the largest depth, before the unloading: rows that the true area is taken from
# Of the finest cells, which tools are thought to stand on: how far the edge of the contact_area of the
# history is off. In the cones of B1 in doc/user/benchmarks.md it is by 0.08, rms; where tools know the
# compliance below a cell, by 0.03 at most under the elastic pyramids of B4 (test indentation/benchmarks)
history_resolution, elastic_resolution = 0.125, 0.08

scatter_unknown = (
    "not measured: the history has too few rows near the largest depth to estimate the scatter of the load; "
    "write more rows (history_every of &output), or use a longer hold"
)
held_share = 1e-3  # of the largest depth: a tool that stays so near to it is held there

# name of the table's row, key, unit ("" for a pure number)
table = [
    ("largest depth h", "max_depth", "m"),
    ("load there P", "max_load", "N"),
    ("loading curvature C", "loading_curvature", "Pa"),
    ("loading exponent", "loading_exponent", ""),
    ("stiffness S", "stiffness", "N/m"),
    ("residual depth h_f", "residual_depth", "m"),
    ("h_f / h", "residual_depth_ratio", ""),
    ("exponent of unloading m", "unloading_exponent", ""),
    ("epsilon", "epsilon", ""),
    ("beta", "beta", ""),
    ("contact depth h_c", "contact_depth", "m"),
    ("area, Oliver-Pharr", "area_oliver_pharr", "m2"),
    ("area, true", "area_true", "m2"),
    ("area, of the history", "area_history", "m2"),
    ("area, from the profile", "area_profile", "m2"),
    ("hardness, Oliver-Pharr", "hardness_oliver_pharr", "Pa"),
    ("hardness, true", "hardness_true", "Pa"),
    ("E_r, Oliver-Pharr", "modulus_oliver_pharr", "Pa"),
    ("E_r, true", "modulus_true", "Pa"),
    ("E_r of the scene", "modulus_scene", "Pa"),
    ("E, Oliver-Pharr", "young_oliver_pharr", "Pa"),
    ("E, true", "young_true", "Pa"),
    ("E of the scene", "young_scene", "Pa"),
    ("work of loading", "work_total", "J"),
    ("plastic / total work", "work_ratio", ""),
    ("pile-up (sink-in below 0)", "pile_up", "m"),
    ("highest, loaded", "pile_up_peak", "m"),
    ("highest, unloaded", "pile_up_peak_unloaded", "m"),
]


class Missing(Exception):
    """There is nothing to analyse; the text is a sentence that says why."""


class Record:
    """What a tool met: time (s), depth below the undeformed surface (m), load against the tool's way and
    projected area of the contact (N, m2) of the full body."""

    def __init__(self, run, tool):
        self.tool, self.name = tool, tool["name"][0]
        history = run.tool_history(tool)
        if history is None or history.rows == 0:
            raise Missing(f"{run.directory}: there is no history of the tool: tool_{self.name}.dat")
        self.history = history
        self.share = indentation.share_of_body(history)
        self.body, gap = indentation.indented_body(run.case, tool, history)
        self.time, self.depth = history["time"], history["depth"] - gap
        axis = indentation.unit_axis(tool)
        self.load = -sum(history[f"load_{x}"] * along for x, along in zip("xyz", axis)) / self.share
        self.area = history["contact_area"] / self.share
        self.cell = run.case["grid"][0]["cell_size"][0] / 2 ** depth_of(run.case)
        knows = "max_deflection" in history.columns and np.any(history["max_deflection"] > 0)
        self.edge_off = self.cell * (elastic_resolution if knows else history_resolution)  # m
        if not all(np.all(np.isfinite(values)) for values in (self.time, self.depth, self.load, self.area)):
            raise Missing(f"tool_{self.name}.dat holds values that are not finite")
        if not np.any((self.load > 0) & (self.depth > 0)):
            what = "is never in contact: its load is always 0; its"
            if np.any(self.load > 0):
                what = "bears a load but does not go in: its"
            raise Missing(
                f"the tool {self.name} {what} largest depth below the surface is "
                f"{1e9 * float(self.depth.max()):.4g} nm"
            )


def chosen_tool(run, name):
    names = [tool["name"][0] for tool in run.tools]
    if not names:
        raise Missing(f"{run.directory}: the run has no tool")
    if name is None:
        if len(names) > 1:
            raise Missing(f"the run has {len(names)} tools; choose one: TOOL={' or TOOL='.join(names)}")
        return run.tools[0]
    if name not in names:
        raise Missing(f"the run has no tool {name}; it has {', '.join(names)}")
    return run.tools[names.index(name)]


def material_of(run, body):
    return next(m for m in run.case["material"] if m["name"] == body["material"])


def default_beta(tool, poisson):
    """The factor beta that a tool has where none is said, and why."""
    shape = tool["shape"][0]
    if shape == "cone":
        if poisson is None:
            return 1.0, "Hay's factor of a cone requires Poisson's ratio, which the law does not have"
        return (
            oliver_pharr.hay_factor(tool["half_angle"][0], poisson),
            "Hay's factor of a rigid cone, with Poisson's ratio of the scene",
        )
    if shape == "pyramid" and tool["faces"][0] == 4:
        return 1.012, "King's factor of a square pyramid"
    if shape in ("berkovich", "pyramid"):
        return 1.034, "King's factor of a triangular pyramid"
    return 1.0, (
        f"exact for small contacts of a {shape}"
        if shape in ("sphere", "flat")
        else f"no factor is known for a {shape}"
    )


def area_function_of(tool, coefficients):
    if coefficients:
        return oliver_pharr.fitted_area(coefficients), "area function with the given coefficients"
    numbers = {
        name: tool[name][0] for name in ("half_angle", "radius", "faces", "tip_radius") if name in tool
    }
    return oliver_pharr.ideal_area(tool["shape"][0], **numbers), f"ideal {tool['shape'][0]}"


def area_at(record, row):
    """The column contact_area at a row (m2) and its uncertainty: a parabola over depth through the rows
    before it, within area_share of its depth, and their scatter about it (not divided by their number: what
    the column is off by is off in many rows), with what the edge of a circle may be off."""
    first = row
    while first > 0 and record.depth[first - 1] >= (1 - area_share) * record.depth[row]:
        first -= 1
    area, depth = record.area[first : row + 1], record.depth[first : row + 1]
    x = (depth - depth[-1]) / record.depth[row]
    if area.size < 8 or np.unique(x).size < 4:
        value, scatter = float(area[-1]), float(np.std(area)) if area.size > 1 else float("nan")
    else:
        curve = np.polyfit(x, area, 2)
        value, scatter = float(curve[2]), float(np.std(area - np.polyval(curve, x), ddof=3))
    edge = record.edge_off * 2 * math.sqrt(math.pi * max(value, 0.0))
    return value, math.hypot(scatter, edge)


def analyse(run, record, options):
    """All that the record and the snapshots give: a dictionary for the JSON, and what the plots need."""
    material = material_of(run, record.body)
    poisson = material["poisson"][0] if "young" in material else None
    beta, beta_reason = (
        (options.beta, "as given") if options.beta is not None else default_beta(record.tool, poisson)
    )
    area_function, area_name = area_function_of(record.tool, options.area_coefficients)
    answer = {key: None for key in keys}
    answer.update(
        tool=record.name,
        shape=record.tool["shape"][0],
        model_share=record.share,
        title=run.title.replace(r"\$", "$"),
        beta=beta,
        beta_reason=beta_reason,
        area_function=area_name if area_function else None,
        epsilon_reason="as given" if options.epsilon is not None else "from the exponent of the unloading",
        window=[s / 100 for s in options.window],
        missing=[],
        notes=[],
    )
    if poisson is not None:
        answer["young_scene"] = material["young"][0]
        answer["modulus_scene"] = material["young"][0] / (1 - poisson**2)
        if material["model"][0].lower() == "maxwell":
            answer["scene_reason"] = "instantaneous, before anything has relaxed"
    if area_function is None:
        answer["missing"].append(
            f"No area function for a {record.tool['shape'][0]}: no Oliver-Pharr evaluation (give one by "
            "--area-coefficients)."
        )
    unloadings = oliver_pharr.find_unloadings(record.depth)
    results = []

    def analysed(unloading, true):
        return oliver_pharr.analyse_unloading(
            record.depth,
            record.load,
            unloading,
            area_function,
            beta,
            options.epsilon,
            tuple(answer["window"]),
            true if true[0] > 0 else None,
            poisson,
        )

    for unloading in unloadings:
        try:
            true = area_at(record, unloading.start)
            results.append((unloading, analysed(unloading, true), true))
        except oliver_pharr.NotEnough as error:
            answer["missing"].append(
                f"The unloading from {1e9 * record.depth[unloading.start]:.4g} nm is not evaluated: {error}."
            )
    if results:
        main = max(results, key=lambda r: r[1].values["max_depth"])
        unloading, result, true = main
        row, load, load_sigma = unloading.start, result.values["max_load"], result.sigma["max_load"]
        put(answer, result.values, result.sigma)
        answer.update(
            {
                f"stiffness_uncertainty_{kind}": result.parts[f"stiffness_{kind}"]
                for kind in ("noise", "window")
            }
        )
        answer["load_scatter"] = result.parts["load_scatter"]
        if not 1.001 < result.values["unloading_exponent"] < 19.9:
            answer["notes"].append(
                "The fitted exponent of the unloading is at its bound, "
                f"{result.values['unloading_exponent']:.3g}: the unloading is not a power law. See "
                "hardness_load_depth.png; unload more slowly, or give --epsilon."
            )
        put(answer, *oliver_pharr.work(record.depth, record.load, unloading, result.fit))
        if not np.any(record.load[unloading.start : unloading.end + 1] <= 0):
            answer["notes"].append(
                "The unloading ends before the load is 0: the recovered work beyond it is that of the fit."
            )
    else:
        main, (first, row) = None, held_rows(record)
        unloading = oliver_pharr.Unloading(first, row, row)
        # the scatter of single rows is not known where there are too few
        load, load_sigma = oliver_pharr.load_at_start(record.depth, record.load, unloading, math.nan)
        if not unloadings:
            answer["missing"].append(
                f"The run has no unloading of more than {100 * oliver_pharr.turn_share:g} % of the depth: no "
                "stiffness, contact depth, Oliver-Pharr evaluation, moduli and work ratio. Reverse `speeds` "
                "of the tool (or `loads`), as in input/indenter.nml."
            )
        put(
            answer,
            {"max_depth": float(record.depth[row]), "max_load": load},
            {"max_depth": 0.0, "max_load": load_sigma},
        )
        true = area_at(record, row)
    try:
        value, sigma, exponent, exponent_sigma = oliver_pharr.loading_curvature(
            record.depth, record.load, row
        )
        put(
            answer,
            {"loading_curvature": value, "loading_exponent": exponent},
            {"loading_curvature": sigma, "loading_exponent": exponent_sigma},
        )
        if record.tool["shape"][0] not in ("cone", "berkovich", "pyramid"):
            answer["notes"].append(
                f"The load under a {record.tool['shape'][0]} is not proportional to the square of the "
                "depth: the loading curvature is the mean of P/h^2 over the second half of the depth."
            )
    except oliver_pharr.NotEnough as error:
        answer["missing"].append(f"The loading curvature is missing: {error}.")
    pictures = surfaces(run, record, row, main, true, answer)
    if true[0] > 0:
        put(answer, {"area_history": true[0]}, {"area_history": true[1]})
    answer["area_true_source"], true = true_area(options, true, answer)
    if answer["area_true_source"] == "profile" and main:
        again = analysed(main[0], true)
        put(answer, again.values, again.sigma)
        results[results.index(main)] = (main[0], again, true)
    if true[0] > 0:
        put(
            answer,
            {"area_true": true[0], "hardness_true": load / true[0]},
            {
                "area_true": true[1],
                "hardness_true": load / true[0] * math.hypot(load_sigma / load, true[1] / true[0]),
            },
        )
    else:
        answer["missing"].append("The true area is missing: contact_area is 0 at the largest depth.")
    answer["unloadings"] = []
    for one, result, area in results:
        answer["unloadings"].append(depth_row(one, result, area))
        widen(run, record, material, one, result.fit, area, answer["unloadings"][-1])
    motion = widen(run, record, material, unloading, main[1].fit if main else None, true, answer)
    kinetic_share(run, record, row, main, answer, motion)
    return answer, results, main, pictures


def widen(run, record, material, unloading, fit, true, book):
    """Into the uncertainties of a book of numbers (the answer, or one unloading's) what the curve does not
    show: inertia, cells, the base, lost energy (systematic.py). `parts` has them by key and cause;
    `not_measured` names the unreliable numbers, which are in `untrusted` alone. Returns the Motion."""
    energy = energy_of(run)
    ratio = book.get("work_ratio")
    if ratio is None and fit is not None:
        ratio = oliver_pharr.work(record.depth, record.load, unloading, fit)[0]["work_ratio"]
    motion = systematic.motion_of(
        run.case,
        material,
        record,
        unloading,
        fit,
        true[0],
        1 - ratio if ratio is not None else float(material["model"][0].lower() in systematic.elastic),
        energy,
    )
    lost = lost_share(energy, record.time[unloading.end])
    area = true[0] if true[0] > 0 else math.pi * record.depth[unloading.start] ** 2
    stiffness, reach = book.get("stiffness") or 0.0, {}
    if stiffness:
        top, below = book["max_depth"], book["contact_depth"]
        reach["residual_depth"] = reach["residual_depth_ratio"] = (
            top / max(book["residual_depth"], 1e-3 * top) - 1
        )
        reach["contact_depth"] = (top - below) / below
        reach["area_oliver_pharr"] = reach["hardness_oliver_pharr"] = 2 * (top - below) / below
    parts = systematic.parts_of(
        motion,
        systematic.cells_to_the_edge(area, record.cell),
        systematic.base_share(run.case, record.body, material, stiffness, indentation.unit_axis(record.tool)),
        ratio,
        lost,
        reach,
        imprint.is_round(run.case),
    )
    book["parts"] = {}
    for key, causes in parts.items():
        value, sigma = book.get(key), book.get(f"{key}_uncertainty")
        if value is None or sigma is None:
            continue
        unit = 1.0 if key == "work_ratio" else abs(value)
        book["parts"][key] = {"curve": sigma, **{cause: share * unit for cause, share in causes.items()}}
        book[f"{key}_uncertainty"] = math.hypot(*book["parts"][key].values())
    book["energy_balance_share"] = lost
    book["motion"] = {name: v for name, v in vars(motion).items() if math.isfinite(v)}
    book["not_measured"] = {
        key: why for key, why in systematic.not_measured(motion).items() if book.get(key) is not None
    }
    if book.get("hardness_true") is not None and book.get("hardness_true_uncertainty") is None:
        book["not_measured"].setdefault("hardness_true", scatter_unknown)
    book["untrusted"] = {}
    for key in book["not_measured"]:
        book["untrusted"][key] = [book[key], book.get(f"{key}_uncertainty")]
        book[key] = book[f"{key}_uncertainty"] = None
    return motion


def true_area(options, column, answer):
    """The true area and its uncertainty (m2), and where it is from: 'column', contact_area of the history, or
    'profile', where the surface leaves the tool. By default the profile is only used if the history has no
    area; a note says where the two are far apart."""
    profile, sigma = answer.get("area_profile"), answer.get("area_profile_uncertainty")
    if options.area == "profile" and profile is None:
        raise Missing(
            "no area from the profile (--area profile): it requires a snapshot at the largest depth and a "
            "sphere, cone or pyramid on a flat surface"
        )
    if not profile:
        return "column", column
    if options.area == "profile" or (options.area == "auto" and not column[0] > 0):
        return "profile", (profile, sigma)
    if abs(profile - column[0]) > 2 * math.hypot(sigma, column[1]) and abs(profile / column[0] - 1) > 0.05:
        answer["notes"].append(
            f"contact_area of the history differs by {100 * (column[0] / profile - 1):+.0f} % from the area "
            "in which the surface touches the tool (area_profile); `--area profile` uses the latter."
        )
    return "column", column


def put(answer, values, sigma):
    """Numbers into the answer, each with its uncertainty beside it."""
    for key, value in values.items():
        answer[key] = None if value is None or not math.isfinite(value) else value
        if sigma.get(key) is not None:
            answer[f"{key}_uncertainty"] = sigma[key] if math.isfinite(sigma[key]) else None


def held_rows(record):
    """First and last row of a hold at the largest depth, where the tool stays within held_share of it; both
    the row of that depth where it is not held."""
    held = record.depth >= (1 - held_share) * np.max(record.depth)
    first = last = int(np.argmax(record.depth))
    while first > 0 and held[first - 1]:
        first -= 1
    while last + 1 < held.size and held[last + 1]:
        last += 1
    down = last + 1 < held.size  # rows of a way back that follows are none of the hold
    while down and last > first and record.depth[last + 1] < record.depth[last] < record.depth[last - 1]:
        last -= 1
    return (first, last) if last - first >= oliver_pharr.hold_rows else (int(np.argmax(record.depth)),) * 2


def depth_row(unloading, result, true):
    """The numbers of one unloading, for H and E over depth."""
    row = {}
    put(row, result.values, result.sigma)
    if true[0] > 0:
        load, sigma = result.values["max_load"], result.sigma["max_load"]
        put(
            row,
            {"area_true": true[0], "hardness_true": load / true[0]},
            {
                "area_true": true[1],
                "hardness_true": load / true[0] * math.hypot(sigma / load, true[1] / true[0]),
            },
        )
    return row


def energy_of(run):
    """The history of the run's energies; None where there is none."""
    path = run.directory / "energy.dat"
    if not path.is_file():
        return None
    energy = History(path)
    if not all(np.all(np.isfinite(values)) for values in energy.columns.values()):
        raise Unreadable(f"{path} holds values that are not finite")
    return energy if energy.rows else None


def lost_share(energy, time):
    """The error of the run's energy balance at a time, as a share of the work: work that neither the material
    nor its motion has. None where there are no energies."""
    if energy is None:
        return None
    return abs(float(np.interp(time, energy["time"], energy["balance_error"])))


def kinetic_share(run, record, row, main, answer, motion):
    """Largest kinetic energy over the second half of the loading and the unloading, as a share of the tools'
    work: a quasi-static curve has less than 1 %. And that of the loading, as a share of what unloading gives
    back: soft metal gives little back. Where it is large the `motion` says what to do."""
    energy = energy_of(run)
    if energy is None:
        return
    half = record.time[np.argmax(record.depth >= 0.5 * record.depth[row])]
    last = record.time[main[0].end if main else row]
    share = indentation.kinetic_share(energy, half, last)
    if share is None:
        return
    answer["kinetic_share"] = share
    if answer["kinetic_share"] > 0.01:
        answer["notes"].append(
            f"The kinetic energy reaches {100 * answer['kinetic_share']:.2g} % of the work in the evaluated "
            f"part of the curve: it is not quasi-static; {motion.cure()}."
        )
    loading = indentation.kinetic_share(energy, half, record.time[row])
    if answer.get("work_ratio") is None or answer["work_ratio"] >= 1.0 or loading is None:
        return
    answer["kinetic_over_returned"] = loading / (1.0 - answer["work_ratio"])
    if answer["kinetic_over_returned"] > 0.1:
        answer["notes"].append(
            f"The kinetic energy during the loading is {100 * answer['kinetic_over_returned']:.2g} % of the "
            f"energy recovered in unloading: the load drops when the tool stops; {motion.cure()}."
        )


# ---- the imprint ----


def surfaces(run, record, row, main, true, answer):
    """The surfaces at the largest depth and unloaded, as (snapshot's time, depth, surface, profile) by name;
    what is missing is said in the answer."""
    found = {}
    try:
        frame, body = imprint.frame_of(run.case, record.tool, record.history)
    except imprint.NoSurface as error:
        answer["missing"].append(f"Profile and pile-up are missing: {error}.")
        return found
    snapshots = snapshot_paths(run.directory)
    times = [time_of(path) for path in snapshots]
    number = run.case["body"].index(body) + 1
    normals = imprint.symmetric_directions(run.case, record.tool)
    area = true[0] if true[0] > 0 else math.pi * record.depth[row] ** 2
    reach = max(4 * math.sqrt(area / math.pi), 3 * record.depth[row])
    wanted = [("loaded", record.time[row])]
    if main:
        free = np.flatnonzero(record.load[main[0].start :] <= 0)
        wanted.append(
            ("unloaded", record.time[main[0].start + free[0]] if free.size else record.time[main[0].end])
        )
    for name, time in wanted:
        if not times:
            answer["missing"].append(
                "No profile and pile-up: the run wrote no particle files (formats of &output)."
            )
            break
        if name == "loaded":
            at = int(np.argmin(np.abs(np.array(times) - time)))
        else:
            later = [i for i, t in enumerate(times) if t >= time * (1 - 1e-9)]
            if not later:
                answer["missing"].append(
                    "No unloaded surface: there is no snapshot after the end of the unloading (`every` of "
                    "&output)."
                )
                continue
            at = later[0]
        depth = float(np.interp(times[at], record.time, record.depth))
        if name == "loaded" and abs(depth - record.depth[row]) > 0.02 * record.depth[row]:
            answer["missing"].append(
                "No profile and pile-up: the snapshot nearest to the largest depth is at "
                f"{100 * depth / record.depth[row]:.3g} % of it; choose `every` of &output for a snapshot at "
                "the largest depth."
            )
            continue
        try:
            particles = Particles(snapshots[at])
            surface = imprint.surface_of(particles, frame, run.case, number, reach, normals)
            found[name] = (times[at], depth, surface, imprint.radial_profile(surface, reach))
        except imprint.NoSurface as error:
            answer["missing"].append(f"The {name} surface is missing: {error}.")
    if "loaded" in found:
        profile, depth = found["loaded"][3], found["loaded"][1]
        edge = math.sqrt(true[0] / math.pi) if true[0] > 0 else None
        answer["profile_time"], answer["profile_depth"] = found["loaded"][:2]
        touched = imprint.contact_area(found["loaded"][2], record.tool, -depth)
        if touched:
            area, area_sigma, edge, edge_sigma = touched
            put(answer, {"area_profile": area}, {"area_profile": area_sigma})
        if edge is not None:
            try:
                round_edge = math.sqrt(area / math.pi) if touched else edge
                value, sigma, peak, at = imprint.pile_up(profile, round_edge, depth)
                if touched:  # there the surface is the tool's
                    value = float(imprint.tool_height(record.tool, np.array([[edge, 0.0]]))[0]) - depth
                    sides = [
                        float(imprint.tool_height(record.tool, np.array([[edge + s * edge_sigma, 0.0]]))[0])
                        for s in (-1, 1)
                    ]
                    sigma = 0.5 * abs(sides[1] - sides[0])
                put(answer, {"pile_up": value}, {"pile_up": sigma})
                answer["pile_up_peak"], answer["pile_up_peak_radius"] = peak, at
                if "unloaded" in found:
                    _, _, peak, at = imprint.pile_up(found["unloaded"][3], round_edge, depth)
                    answer["pile_up_peak_unloaded"], answer["pile_up_peak_unloaded_radius"] = peak, at
            except imprint.NoSurface as error:
                answer["missing"].append(f"Pile-up is missing: {error}.")
    return found


def time_of(path):
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return float(np.ravel(file.attrs["time"])[0])
    except (OSError, KeyError) as error:
        raise Unreadable(f"{path}: {error}")


# ---- files ----


def write(path, text):
    """Written under another name and renamed: complete or not there."""
    partial = path.with_name(f".{path.name}.part")
    partial.write_text(text)
    os.replace(partial, path)
    print(path)


def csv_text(names, rows):
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([["" if v is None else f"{v:.10g}" for v in row] for row in rows])
    return out.getvalue()


def print_table(answer):
    print(
        f"{answer['title']}: tool {answer['tool']} ({answer['shape']}); loads and areas of the full body "
        f"(modelled share {answer['model_share']:g})"
    )
    for label, key, unit in table:
        value, sigma = answer.get(key), answer.get(f"{key}_uncertainty")
        if key in answer["not_measured"]:
            print(f"  {label:<27} not measured")
        if value is None:
            continue
        if unit == "m2":
            factor, name = 1e-12, "um2"
        else:
            factor, name = scaled(unit, [value, sigma or 0.0]) if unit else (1.0, "")
        line = f"  {label:<27} {value / factor:>10.5g} {name:<4}"
        if sigma is not None:
            share = f"   {100 * sigma / abs(value):5.2g} %" if value else ""
            line += f" +- {sigma / factor:<9.2g}{share}"
        if key == "beta":
            line += f"   {answer['beta_reason']}"
        if key == "epsilon":
            line += f"   {answer['epsilon_reason']}"
        if key in ("modulus_scene", "young_scene") and answer.get("scene_reason"):
            line += f"   {answer['scene_reason']}"
        if key == "area_oliver_pharr":
            line += f"   {answer['area_function']}"
        print(line.rstrip())
    if answer.get("stiffness") is not None:
        print(
            "  contributions to the uncertainty of S: noise "
            f"{answer['stiffness_uncertainty_noise'] / answer['stiffness']:.2%}, "
            f"window {answer['stiffness_uncertainty_window'] / answer['stiffness']:.2%}; fit over "
            f"{100 * answer['window'][0]:g} to {100 * answer['window'][1]:g} % of the load"
        )
    if len(answer["unloadings"]) > 1:
        print("  depth [nm]   H, O-P [GPa]     H, true [GPa]    E_r, O-P [GPa]   E_r, true [GPa]")
        for row in answer["unloadings"]:
            words = [f"{1e9 * row['max_depth']:10.5g}  "]
            for key in ("hardness_oliver_pharr", "hardness_true", "modulus_oliver_pharr", "modulus_true"):
                value, sigma = row.get(key), row.get(f"{key}_uncertainty") or 0.0
                words.append(
                    f"{1e-9 * value:8.4g} +- {1e-9 * sigma:<6.2g}"
                    if value is not None
                    else f"{'not measured' if key in row['not_measured'] else '':18}"
                )
            print(" ".join(words))
    for why in dict.fromkeys(answer["not_measured"].values()):
        print(f"  {why}")
    for sentence in answer["notes"] + answer["missing"]:
        print(f"  {sentence}")


def write_files(run, record, answer, results, pictures, suffix):
    def path(name, end):
        return run.directory / f"{name}{suffix}.{end}"

    write(path("hardness", "json"), json.dumps(answer, indent=2, allow_nan=False) + "\n")
    write(
        path("hardness", "csv"),
        csv_text(
            ["time [s]", "depth [nm]", "load [mN]"], zip(record.time, 1e9 * record.depth, 1e3 * record.load)
        ),
    )
    title = str(run.case.get("scene", [{}])[0].get("title", [""])[0])
    write(path("hardness", "hld"), hld_text(record.time, record.depth, record.load, record.tool, title))
    if pictures:
        rows = []
        for name, (_, _, _, profile) in pictures.items():
            for r, mean, low, high, stress, contact in zip(
                profile.radius, profile.mean, profile.lowest, profile.highest, profile.stress, profile.contact
            ):
                rows.append(
                    [
                        0.0 if name == "loaded" else 1.0,
                        *(1e9 * np.array([r, mean, low, high])),
                        *(1e-9 * np.array([stress, contact])),
                    ]
                )
        write(
            path("hardness_profile", "csv"),
            csv_text(
                [
                    "unloaded [1]",
                    "radius [nm]",
                    "height [nm]",
                    "lowest [nm]",
                    "highest [nm]",
                    "normal stress [GPa]",
                    "contact pressure [GPa]",
                ],
                rows,
            ),
        )
    if len(results) > 1:
        names = ("hardness_oliver_pharr", "hardness_true", "modulus_oliver_pharr", "modulus_true")
        columns = [c for name in names for c in (name, f"{name}_uncertainty")]
        write(
            path("hardness_depth", "csv"),
            csv_text(
                ["depth [nm]", "load [mN]"] + [f"{name} [GPa]" for name in columns],
                [
                    [1e9 * row["max_depth"], 1e3 * row["max_load"]]
                    + [None if row.get(c) is None else 1e-9 * row[c] for c in columns]
                    for row in answer["unloadings"]
                ],
            ),
        )


# ---- the command ----


def numbers(text):
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text}: must be a list of numbers, as 24.5,1e3")


def window_of(text):
    shares = numbers(text)
    if len(shares) != 2 or not 0 < shares[0] < shares[1] <= 100:
        raise argparse.ArgumentTypeError(f"{text}: must be two increasing numbers in per cent, as 20,98")
    return tuple(shares)


def positive(text):
    value = numbers(text)
    if len(value) != 1 or not 0 < value[0] < math.inf:
        raise argparse.ArgumentTypeError(f"{text}: must be a number above 0")
    return value[0]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--tool")
    parser.add_argument("--window", type=window_of, default=(20.0, 98.0))
    parser.add_argument("--epsilon", type=positive)
    parser.add_argument("--beta", type=positive)
    parser.add_argument("--area-coefficients", type=numbers)
    parser.add_argument("--area", choices=("auto", "column", "profile"), default="auto")
    parser.add_argument("--no-plots", action="store_true")
    options = parser.parse_args()
    try:
        if not options.run.is_dir():
            raise Missing(f"{options.run}: no such directory")
        run = Run(options.run)
        if not run.case:
            raise Missing(f"{options.run}: no case.nml: not the directory of a run")
        if is_flat(run.case["grid"][0]) and not imprint.is_round(run.case):
            raise Missing(
                f"{options.run}: the scene is one of plane strain; hardness and modulus need a contact area"
            )
        tool = chosen_tool(run, options.tool)
        record = Record(run, tool)
        answer, results, main, pictures = analyse(run, record, options)
    except (Missing, Unreadable) as error:
        print(f"hardness: {error}", file=sys.stderr)
        return 2
    except senseless as error:
        print(f"hardness: {options.run}: what the run wrote {why(error)}", file=sys.stderr)
        return 2
    print_table(answer)
    suffix = f"_{record.name}" if len(run.tools) > 1 else ""
    write_files(run, record, answer, results, pictures, suffix)
    if options.no_plots:
        return 0
    pictures_of.draw_load_depth(
        run, record, answer, results, run.directory / f"hardness_load_depth{suffix}.png"
    )
    if pictures:
        pictures_of.draw_profile(run, record, pictures, run.directory / f"hardness_profile{suffix}.png")
    if "loaded" in pictures:
        pictures_of.draw_pressure(
            run, record, answer, pictures["loaded"], run.directory / f"hardness_pressure{suffix}.png"
        )
    if len(results) > 1:
        pictures_of.draw_over_depth(run, answer, run.directory / f"hardness_depth{suffix}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
