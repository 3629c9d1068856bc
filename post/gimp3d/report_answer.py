"""The first screen of a report: what the run was made for. Of an indentation the load-depth curve with its
Oliver-Pharr line, hardness and modulus with their uncertainties; else the first curve and its largest values."""

import json

import numpy as np

from . import indentation
from .api import RunFailed, command
from .report_charts import listed
from .report_page import si, tag

least_drop = 0.2  # of the largest load that an unloading takes off

quantities = (
    ("Hardness, true area", "hardness_true", "Pa", 1.0),
    ("Hardness, Oliver-Pharr", "hardness_oliver_pharr", "Pa", 1.0),
    ("Young's modulus, true area", "modulus_true", "Pa", None),
    ("Young's modulus, Oliver-Pharr", "modulus_oliver_pharr", "Pa", None),
    ("Stiffness", "stiffness", "N/m", 1.0),
    ("Contact depth", "contact_depth", "m", 1.0),
    ("Largest depth", "max_depth", "m", 1.0),
    ("Largest load", "max_load", "N", 1.0),
)


def load_of(tool, history):
    """Against the tool's way, of the full body, N."""
    share = indentation.share_of_body(history)
    way = zip("xyz", indentation.unit_axis(tool))
    return -sum(history[f"load_{axis}"] * direction for axis, direction in way) / share


def time_of_largest_load(tools):
    """Of the first tool that bears one, s; None where there is none."""
    for tool, history in tools.values():
        load = load_of(tool, history)
        if np.any(np.isfinite(load)) and np.nanmax(load) > 0:
            return history["time"][np.nanargmax(load)]
    return None


def comes_back(tool, history):
    """True where the tool has been pressed in and has unloaded since."""
    load = load_of(tool, history)
    if not np.all(np.isfinite(load)) or not load.max() > 0:
        return False
    return load[np.argmax(load) :].min() < (1 - least_drop) * load.max()


def hardness_of(report, name):
    """What make hardness says of a tool: its file, made here where the run has none and the tool comes
    back."""
    several = len(report.run.tools) > 1
    path = report.directory / (f"hardness_{name}.json" if several else "hardness.json")
    tool, history = report.tools[name]
    there = path.is_file() and report.is_of_run(path)
    if not there and report.state == "finished" and comes_back(tool, history):
        try:
            command("hardness", report.directory, tool=name, no_plots=True)
        except (RunFailed, OSError):  # the page goes on without: what is missing is said by make hardness
            return None
    elif not there:
        return None
    try:
        answer = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return answer if isinstance(answer, dict) else None


def unloading_line(answer):
    """The Oliver-Pharr line: the tangent at the largest load, down to where it has none (m, N)."""
    depth, load, stiffness = (answer.get(key) for key in ("max_depth", "max_load", "stiffness"))
    if not (depth and load and stiffness):
        return None
    return [depth - load / stiffness, depth], [0.0, load]


def add_line(spec, answer):
    """The line as a curve of the chart of load over depth."""
    line = unloading_line(answer)
    if line is None or spec["axes"][0]["name"] != "depth":
        return
    spec["views"][0]["series"].append(
        {
            "name": "Oliver-Pharr: tangent at the largest load",
            "x": listed(np.array(line[0])),
            "y": listed(np.array(line[1])),
            "axis": 0,
            "mark": "dashed",
        }
    )


def hide_theory(case, spec):
    """The load of an elastic half-space is not shown at first beside that of a body that yields."""
    if any("yield_stress" in material for material in case.get("material", [])):
        for series in spec["views"][0]["series"]:
            if "half-space" in series["name"]:
                series["hidden"] = True


def rows_of(report, name, answer):
    """(label, value) of the first screen."""
    tool, history = report.tools[name]
    if answer is None:
        load = load_of(tool, history)
        rows = [("Largest travel", si(np.nanmax(history["depth"]), "m"))]
        if np.any(np.isfinite(load)):
            rows.append(("Largest load, full body", si(np.nanmax(load), "N")))
        return rows + [
            ("Largest contact area", si(np.nanmax(history["contact_area"]), "m2")),
            ("Load at the end, full body", si(load[-1], "N")),
        ]
    rows = []
    for label, key, unit, factor in quantities:
        value, sigma = answer.get(key), answer.get(f"{key}_uncertainty")
        if value is None:
            continue
        if factor is None:
            factor = 1 - (answer.get("poisson") or poisson_of(report)) ** 2
        rows.append((label, si(factor * value, unit, error=factor * sigma if sigma else None)))
    return rows


def poisson_of(report):
    """Of the first material that has one; of a rigid tool's body."""
    for material in report.run.case.get("material", []):
        if "poisson" in material:
            return material["poisson"][0]
    return 0.0


def section_of(report, chart):
    """The first screen; `chart`: the figure that stands beside the numbers."""
    blocks = []
    for name in list(report.tools)[:1]:
        answer = report.answers.get(name)
        cells = [
            tag("div", tag("dt", label), tag("dd", value)) for label, value in rows_of(report, name, answer)
        ]
        blocks.append(tag("dl", *cells, class_="facts"))
        if answer:
            blocks.append(
                tag(
                    "p",
                    "The tool is rigid. ",
                    tag("a", "All of it, with notes", href="#hardness"),
                    class_="quiet",
                )
            )
    return tag(
        "section",
        tag("h2", "In short"),
        tag("div", tag("div", *blocks), *([chart] if chart else []), class_="answer"),
        id="answer",
    )
