"""Readers of measured curves, and of numbers that were derived from them.

A curve is a text table: `.csv`, `.txt` with a head line whose columns carry units (`depth [nm], load [mN],
time [s]`, `Disp_nm  Force_uN  Time_s`; table_text.py), Hysitron's `.hld`, or the `tool_NAME.dat` of a run. A
table of derived numbers has columns C, S, Wp/Wt, hf/hmax, hmax, Pmax, one row an indentation."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..run_data import Unreadable, text_in
from . import table_text
from .table_text import found_unit, in_si, split_name

KINDS = {  # dimension, names
    "depth": ("length", (
        "depth", "disp", "displacement", "h", "penetration", "indentation depth", "penetration depth",
        "displacement into surface",
    )),
    "load": ("load", ("load", "force", "p", "f", "load_z", "load on sample", "normal force")),
    "time": ("time", ("time", "t", "time on sample")),
}  # fmt: skip
AT_SURFACE = ("displacement into surface", "load on sample", "time on sample")  # before plain names
DERIVED = {
    "curvature": ("pressure", ("c", "curvature", "p/h2", "c=p/h2")),
    "stiffness": ("stiffness", ("s", "stiffness", "dp/dh")),
    "work_ratio": ("ratio", ("wp/wt", "work_ratio", "w_p/w_t")),
    "residual_ratio": ("ratio", ("hf/hmax", "hf/hm", "residual_ratio", "h_f/h_max")),
    "max_depth": ("length", ("hmax", "hm", "h_max", "max_depth")),
    "max_load": ("load", ("pmax", "p_max", "max_load")),
}
NAMES = {name for _, names in (*KINDS.values(), *DERIVED.values()) for name in names}


@dataclass
class Curve:
    """Depth (m), load (N), time (s, or None) of one indentation."""

    name: str
    depth: np.ndarray
    load: np.ndarray
    time: np.ndarray | None = None
    notes: list = field(default_factory=list)


@dataclass
class Derived:
    """Numbers of one indentation, SI: some of DERIVED's keys; `sigma` has their relative uncertainties."""

    name: str
    values: dict
    sigma: dict


def read_table(path):
    """Names, units and rows of a text table."""
    return table_text.read_table(path, NAMES)


def has(kind, names):
    return any(name in KINDS[kind][1] for name in names)


def only(path, what, places, names, units):
    """The one of some columns that has the same meaning; raises Unreadable where there are several."""
    if len(places) > 1:
        both = " and ".join(f"`{names[k]} [{units[k]}]`" for k in places[:2])
        raise Unreadable(f"{path}: columns {both} both have the {what}; keep one, or rename the other")
    return places[0]


def column(path, kind, names, units, rows):
    """The column of a kind, in SI; None where there is none. Columns with a unit of another dimension (volts)
    beside it are others. Names of the surface and the sample go before plain ones."""
    dimension, allowed = KINDS[kind]
    named = [k for k, name in enumerate(names) if name in allowed]
    fitting = [k for k in named if (found_unit(units[k]) or ("",))[0] == dimension]
    fitting = [k for k in fitting if names[k] in AT_SURFACE] or fitting
    if not named:
        return None
    at = only(path, kind, fitting, names, units) if fitting else named[0]
    return in_si(path, names[at], units[at], rows[:, at], [dimension])


def hysitron(path):
    """A .hld file: rows behind `Test Data Points`, which name their units."""
    lines = table_text.decoded(path).splitlines()
    starts = [i for i, line in enumerate(lines) if line.lower().replace(" ", "").startswith("testdatapoints")]
    if not starts:
        raise Unreadable(f"{path}: no line `Test Data Points`")
    count = int(re.search(r"\d+", lines[starts[0]])[0])
    names, units = zip(*(split_name(word) for word in lines[starts[0] + 1].split("\t")))
    body = lines[starts[0] + 2 : starts[0] + 2 + count]
    rows = np.array([[float(word) for word in line.split()] for line in body])
    return list(names), list(units), rows


def read_curve(path):
    """The Curve of a file, or its list of Derived: whatever it holds."""
    path = Path(path)
    if path.is_dir():
        return curve_of_run(path, path.name)
    if path.suffix == ".dat" and "VARIABLES" in text_in(path)[:2000]:
        if not (path.parent / "case.nml").exists():
            raise Unreadable(
                f"{path}: the case.nml of its run is not beside it, which has the tool's axis; "
                "give a file in the directory of a run"
            )
        return curve_of_run(path.parent, path.stem, path.stem.removeprefix("tool_"))
    try:
        names, units, rows = hysitron(path) if path.suffix.lower() == ".hld" else read_table(path)
    except (ValueError, IndexError) as error:
        raise Unreadable(f"{path}: {error}")
    if not (has("depth", names) and has("load", names)):
        if any(name in some for name in names for _, some in DERIVED.values()):
            return derived_rows(path, names, units, rows)
        raise Unreadable(f"{path}: columns depth and load are required; it has {', '.join(names)}")
    depth, load, time = (column(path, kind, names, units, rows) for kind in KINDS)
    if len(depth) < 20:
        raise Unreadable(f"{path}: {len(depth)} rows; at least 20 are required")
    for kind, values in (("depths", depth), ("loads", load)):
        if np.max(values) < -np.min(values):
            raise Unreadable(
                f"{path}: {kind} below 0; allowed: loads and depths above 0 where the tool presses"
            )
    if not (np.all(np.isfinite(depth)) and np.all(np.isfinite(load))):
        raise Unreadable(f"{path}: a depth or load is not a finite number")
    if time is not None and not np.all(np.isfinite(time)):
        raise Unreadable(f"{path}: a time is not a finite number")
    return Curve(path.stem, depth, load, time)


def curve_of_run(directory, name, tool=None):
    """The curve of a run's tool, by default the first one: load along its axis, of the whole body."""
    from ..api import Run

    depth, load = Run(directory).load_depth(tool)
    time = Run(directory).tool(tool)["time"]
    return Curve(name, depth, load, time if len(time) == len(depth) else None)


def derived_rows(path, names, units, rows):
    """One Derived for each row. A column `sigma NAME` has the uncertainty of NAME: with a unit of NAME the
    absolute one, without a unit or in % the relative one; of ratios the absolute one always."""
    values, sigma = {}, {}
    bare = [name.removeprefix("sigma").strip(" _") if name.startswith("sigma") else name for name in names]
    for key, (dimension, allowed) in DERIVED.items():
        for of_sigma, columns in ((False, values), (True, sigma)):
            places = [k for k, name in enumerate(bare) if name in allowed and of_sigma == (names[k] != name)]
            if not places:
                continue
            at = only(path, key.replace("_", " "), places, names, units)
            kinds = [dimension, "ratio"] if of_sigma and dimension != "ratio" else [dimension]
            columns[key] = in_si(path, names[at], units[at], rows[:, at], kinds)
            if not np.all(np.isfinite(columns[key])):
                raise Unreadable(f"{path}: column {names[at]}: a value is not a finite number")
            if of_sigma and found_unit(units[at])[0] != "ratio":
                if key not in values:
                    raise Unreadable(f"{path}: column {names[at]}: there is no column that it belongs to")
                columns[key] = columns[key] / values[key]
            if of_sigma and not np.all((columns[key] > 0) & (columns[key] < 1)):
                raise Unreadable(
                    f"{path}: column {names[at]}: uncertainties must be above 0 and below the value"
                )
    if "max_depth" not in values and {"max_load", "curvature"} <= set(values):
        values["max_depth"] = np.sqrt(values["max_load"] / values["curvature"])
    if "stiffness" in values and "max_depth" not in values:
        raise Unreadable(f"{path}: with S the largest depth hmax is required, or C and Pmax")
    row_of = lambda columns, k: {key: float(column[k]) for key, column in columns.items()}
    return [
        Derived(f"{Path(path).stem} {k + 1}", row_of(values, k), row_of(sigma, k)) for k in range(len(rows))
    ]
