"""Readers of measured curves, and of numbers that were derived from them.

A curve is a text table: `.csv`, `.txt` with a head line whose columns carry units (`depth [nm], load [mN],
time [s]`, `Disp_nm  Force_uN  Time_s`), Hysitron's `.hld`, or the `tool_NAME.dat` of a run. A table of
derived numbers has columns C, S, Wp/Wt, hf/hmax, hmax, Pmax, one row an indentation."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..run_data import Unreadable, text_in

UNITS = {
    "m": 1.0, "mm": 1e-3, "um": 1e-6, "\u00b5m": 1e-6, "\u03bcm": 1e-6, "nm": 1e-9,
    "n": 1.0, "mn": 1e-3, "un": 1e-6, "\u00b5n": 1e-6, "\u03bcn": 1e-6, "nn": 1e-9,
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0,
    "pa": 1.0, "mpa": 1e6, "gpa": 1e9, "n/m": 1.0, "mn/nm": 1e6, "un/nm": 1e3, "kn/m": 1e3,
    "%": 0.01, "": 1.0, "1": 1.0, "-": 1.0,
}  # fmt: skip
KINDS = {
    "depth": (
        "depth", "disp", "displacement", "h", "penetration", "indentation depth", "penetration depth",
        "displacement into surface",
    ),
    "load": ("load", "force", "p", "f", "load_z", "load on sample", "normal force"),
    "time": ("time", "t", "time on sample"),
}  # fmt: skip
DERIVED = {
    "curvature": ("c", "curvature", "p/h2", "c=p/h2"),
    "stiffness": ("s", "stiffness", "dp/dh"),
    "work_ratio": ("wp/wt", "work_ratio", "w_p/w_t"),
    "residual_ratio": ("hf/hmax", "hf/hm", "residual_ratio", "h_f/h_max"),
    "max_depth": ("hmax", "hm", "h_max", "max_depth"),
    "max_load": ("pmax", "p_max", "max_load"),
}


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


def split_name(word):
    """`depth [nm]`, `Disp_nm`, `load(mN)`, `C (GPa)` -> bare name, unit, both in small letters."""
    word = word.strip().strip('"').lower()
    found = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\])]*)\s*[\])]", word)
    if found:
        return found[1].strip(), found[2].strip()
    bare, _, tail = word.rpartition("_")
    if bare and tail in UNITS and tail not in ("t", "m", "n"):
        return bare.strip(), tail
    return word, ""


def read_table(path):
    """Names, units and rows of a text table: the last line without numbers before the first row is its
    head."""
    head, rows, begun = None, [], False
    for number, line in enumerate(text_in(path).splitlines(), 1):
        line = line.strip().lstrip("\ufeff")
        if not line:
            continue
        words = [
            w.strip() for w in (re.split(r"[;,\t]", line) if re.search(r"[;,\t]", line) else line.split())
        ]
        try:
            values = [float(word) for word in words if word]
        except ValueError:
            if begun:
                raise Unreadable(f"{path}:{number}: not a row of numbers: {line[:60]}")
            if not line.startswith("#") or any(
                split_name(w)[0] in names
                for w in line[1:].split(",")
                for names in (*KINDS.values(), *DERIVED.values())
            ):
                last = head
                head = [w for w in re.split(r"[;,\t]", line.lstrip("# ")) if w.strip()]
                if last and len(last) == len(head) and all(w.strip(" []()").lower() in UNITS for w in head):
                    head = [f"{name} [{unit.strip(' []()')}]" for name, unit in zip(last, head)]
                if len(head) == 1:
                    head = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", line.lstrip("# "))
            continue
        if values:
            begun = True
            if head and len(values) != len(head):
                raise Unreadable(f"{path}:{number}: {len(values)} values for {len(head)} columns")
            rows.append(values)
    if not rows:
        raise Unreadable(f"{path}: no rows of numbers")
    if not head:
        raise Unreadable(f"{path}: no header line with names and units, as `depth [nm], load [mN]`")
    pairs = [split_name(word) for word in head]
    for name, unit in pairs:
        if not unit and name in sum(KINDS.values(), ()):
            raise Unreadable(f"{path}: column {name} has no unit; give it as in `depth [nm], load [mN]`")
        if unit not in UNITS and name in sum((*KINDS.values(), *DERIVED.values()), ()):
            raise Unreadable(
                f"{path}: column {name} has the unit {unit!r}; "
                "allowed are m, mm, um, nm, N, mN, uN, nN, s, min"
            )
    return [p[0] for p in pairs], [p[1] for p in pairs], np.array(rows)


def column(kinds, names, units, rows):
    """The column of one of several names, in SI; None where there is none."""
    for number, name in enumerate(names):
        if name in kinds:
            return rows[:, number] * UNITS[units[number]]
    return None


def hysitron(path):
    """A .hld file: rows behind `Test Data Points`, which name their units."""
    lines = text_in(path).splitlines()
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
    if any(name in sum(DERIVED.values(), ()) for name in names) and "depth" not in names:
        return derived_rows(path, names, units, rows)
    depth, load = (column(KINDS[kind], names, units, rows) for kind in ("depth", "load"))
    if depth is None or load is None:
        raise Unreadable(f"{path}: columns depth and load are required; it has {', '.join(names)}")
    if len(depth) < 20:
        raise Unreadable(f"{path}: {len(depth)} rows; at least 20 are required")
    if np.max(load) < -np.min(load):
        raise Unreadable(f"{path}: loads below 0; allowed: loads and depths above 0 where the tool presses")
    if not (np.all(np.isfinite(depth)) and np.all(np.isfinite(load))):
        raise Unreadable(f"{path}: a depth or load is not a finite number")
    return Curve(path.stem, depth, load, column(KINDS["time"], names, units, rows))


def curve_of_run(directory, name, tool=None):
    """The curve of a run's tool, by default the first one: load along its axis, of the whole body."""
    from ..api import Run

    depth, load = Run(directory).load_depth(tool)
    time = Run(directory).tool(tool)["time"]
    return Curve(name, depth, load, time if len(time) == len(depth) else None)


def derived_rows(path, names, units, rows):
    """One Derived for each row; a column `sigma NAME` has the relative uncertainty of NAME."""
    found = []
    for number, row in enumerate(rows, 1):
        values, sigma = {}, {}
        for name, unit, value in zip(names, units, row):
            bare = name.removeprefix("sigma").strip()
            key = next((key for key, kinds in DERIVED.items() if bare in kinds), None)
            if key and name.startswith("sigma"):
                sigma[key] = value * UNITS.get(unit, 1.0)
            elif key:
                values[key] = value * UNITS[unit]
        if "max_depth" not in values and {"max_load", "curvature"} <= set(values):
            values["max_depth"] = np.sqrt(values["max_load"] / values["curvature"])
        if "stiffness" in values and "max_depth" not in values:
            raise Unreadable(f"{path}: with S the largest depth hmax is required, or C and Pmax")
        found.append(Derived(f"{Path(path).stem} {number}", values, sigma))
    return found
