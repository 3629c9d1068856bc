#!/usr/bin/env python3
"""Error bars of hardness, modulus and the like from several runs of one indentation (doc/user/hardness.md,
Error bars):

   error_bar.py [options] RUN RUN [RUN ...]          make error_bar RUNS="out/cone out/cone_coarse"

Each run needs its hardness.json (make hardness RUN=...). The answer is that of the run with the finest cells.
To its own uncertainty (fit, less what it guesses of cells, inertia or base where the runs show them) come

   grid    from the runs that differ in their cells alone. Two: the error of first order, |coarse -
           fine|/(ratio - 1). Three or more: 1.25 times the distance to Richardson's limit of the three
           finest, of the order that they show, at most 2; where they show no order, the spread of all of them
   speed   from a run at another speed that has the cells of one of the first: the error of first order in the
           speed, |run - slow| over 1 - 1/ratio of their times, which is twice what half the speed changes
   others  from runs that differ in something else (size of the body, ...) and have the cells of one of the
   first: what that changes

and the error bar is the root of the sum of their squares. Under the finest run: error_bar.json.

   --tool NAME      of several tools

Exit status 2 where runs are missing or are not of one problem; the sentence says which.
"""

import argparse
import json
import math
import sys
from pathlib import Path

from . import study_fit as fit
from .plots import scaled
from .run_data import Unreadable, depth_of, read_namelists, senseless, text_in, why
from .scene_text import is_flat

# name of the row, key of hardness.json, unit
rows = [
    ("hardness, Oliver-Pharr", "hardness_oliver_pharr", "Pa"),
    ("hardness, true", "hardness_true", "Pa"),
    ("E, Oliver-Pharr", "young_oliver_pharr", "Pa"),
    ("E, true", "young_true", "Pa"),
    ("loading curvature C", "loading_curvature", "Pa"),
    ("stiffness S", "stiffness", "N/m"),
    ("area, true", "area_true", "m2"),
    ("h_f / h", "residual_depth_ratio", ""),
    ("plastic / total work", "work_ratio", ""),
]
free = {("scene", name) for name in ("title", "mode", "restart")}  # may differ between any two runs
free_groups = ("output", "checkpoint", "guard", "probe")
grid = {("grid", "cell_size"), ("level", "lower"), ("level", "upper"), ("time", "time_step")}
motion = {("tool", "times"), ("tool", "speeds"), ("tool", "loads"), ("scene", "end_time")}
problem = {"material": None, "tool": ("shape", "half_angle", "radius", "tip_radius", "faces", "friction")}
same_depth = 0.01  # of the depth: runs that went less or further than that from each other are not compared
safety_factor, highest_order = 1.25, 2.0


class Wrong(Exception):
    """The runs give no error bar; the text is a sentence that says why."""


class Case:
    """One run: its directory, finest cell (m), hardness.json, and what its scene says as {(group, number,
    variable): values}."""

    def __init__(self, directory, tool):
        self.directory = directory
        if not directory.is_dir():
            raise Wrong(f"{directory}: no such directory")
        path = directory / ("hardness.json" if not tool else f"hardness_{tool}.json")
        if not path.is_file():
            raise Wrong(f"{directory} has no {path.name} yet: make hardness RUN={directory}")
        try:
            self.answer = json.loads(text_in(path))
        except ValueError as error:
            raise Wrong(f"{path}: {error}")
        self.scene = read_namelists(directory / "case.nml")
        self.cell = self.scene["grid"][0]["cell_size"][0] / 2 ** depth_of(self.scene)
        self.said = {
            (group, number, name): tuple(values)
            for group, ones in self.scene.items()
            if group not in free_groups
            for number, one in enumerate(ones)
            for name, values in one.items()
            if (group, name) not in free
        }
        if is_flat(self.scene["grid"][0]):  # one cell along y, whatever its edge
            for (group, number, name), values in self.said.items():
                if name in ("lower", "upper") and len(values) == 3:
                    self.said[group, number, name] = (values[0], 0.0, values[2])

    def differs(self, other):
        """What two scenes say differently, as a set of (group, variable)."""
        names = self.said.keys() | other.said.keys()
        return {(name[0], name[2]) for name in names if not same(self.said.get(name), other.said.get(name))}


def same(one, other):
    """Whether two lists of values are equal, numbers to nine digits."""
    return (
        one is not None
        and other is not None
        and len(one) == len(other)
        and all(
            (
                math.isclose(a, b, rel_tol=1e-9)
                if isinstance(a, (int, float)) and isinstance(b, (int, float))
                else str(a).lower() == str(b).lower()
            )
            for a, b in zip(one, other)
        )
    )


def sort_out(cases):
    """The runs that differ from the finest in their cells alone, finest first, and (what, the run of the same
    cells among them, run) of each other one. Raises Wrong."""
    finest = min(cases, key=lambda case: case.cell)  # the first of them, where several have its cells
    ladder, others = [], []
    for case in cases:
        differs = finest.differs(case) - grid
        for group, name in sorted(differs):
            if group in problem and (problem[group] is None or name in problem[group]):
                raise Wrong(
                    f"{case.directory} is of another problem than {finest.directory}: &{group} {name} differs"
                )
        depth, wanted = case.answer["max_depth"], finest.answer["max_depth"]
        if abs(depth - wanted) > same_depth * wanted:
            raise Wrong(
                f"{case.directory} goes to {1e9 * depth:.4g} nm, {finest.directory} to {1e9 * wanted:.4g} "
                "nm: runs are compared at one depth"
            )
        if differs:
            others.append((differs, case))
        elif any(math.isclose(case.cell, one.cell, rel_tol=1e-9) for one in ladder):
            raise Wrong(f"{case.directory} has the cells of another run, and nothing else in it differs")
        else:
            ladder.append(case)
    ladder.sort(key=lambda case: case.cell)
    pairs = []
    for differs, case in others:
        partner = next((one for one in ladder if math.isclose(one.cell, case.cell, rel_tol=1e-9)), None)
        if partner is None:
            raise Wrong(
                f"{case.directory} differs in {said(differs)}, and no other run has its cells of "
                f"{1e9 * case.cell:.4g} nm: one thing at a time"
            )
        pairs.append((said(differs), partner, case))
    return ladder, pairs


def said(differs):
    """A name for what differs."""
    if differs <= motion:
        return "speed"
    return " ".join(sorted({f"{group}.{name}" for group, name in differs - motion}))


def grid_error(cells, values, alike=True):
    """Error of the finest of values on cells (m), finest first, and what it rests on: an order, or words.
    None from one run. `alike`: all are measured in one way, so that an order may show."""
    if len(values) < 2:
        return None, ""
    if not alike:
        return max(values) - min(values), "none: spread"
    if len(values) == 2:
        return abs(values[1] - values[0]) / (cells[1] / cells[0] - 1), "1, assumed"
    try:
        _, order = fit.richardson(cells[:3], [[value] for value in values[:3]])
    except fit.NoOrder:
        return max(values) - min(values), "none: spread"
    used = min(order, highest_order)
    h = cells[:2]
    step = abs(values[0] - values[1]) * h[0] ** used / (h[1] ** used - h[0] ** used)
    return safety_factor * step, f"{used:.2f}" if used == order else f"{used:.0f}, not {order:.1f}"


def factor_of(what, partner, case):
    """Error of a run over what another one changes: of first order in the speed where all is slower or faster
    by one factor."""
    slower = case.scene["scene"][0]["end_time"][0] / partner.scene["scene"][0]["end_time"][0]
    return 1 / abs(1 - 1 / slower) if what == "speed" and abs(slower - 1) > 1e-6 else 1.0


def fit_of(answer, key, known):
    """The uncertainty that `make hardness` states, less its parts that other runs measure. None where it
    states none."""
    parts = answer.get("parts", {}).get(key)
    if parts is None:
        return answer.get(f"{key}_uncertainty")
    return math.hypot(*(part for cause, part in parts.items() if cause not in known))


def assess(ladder, pairs):
    """One dictionary a quantity that all runs of the ladder have, and sentences on those that some lack."""
    found, missing = [], []
    alike = len({case.answer.get("area_true_source") for case in ladder}) == 1
    if not alike:
        missing.append(
            "The true area is that of the profile in some runs and of the history in others: no order is "
            "taken from it (`make hardness` with `--area column` for all of them makes them alike)."
        )
    for title, key, unit in rows:
        values = [case.answer.get(key) for case in ladder]
        if any(value is None for value in values):
            if any(value is not None for value in values):
                missing.append(f"{title}: not every run has it")
            continue
        by_area = key.endswith("_true")
        error, order = grid_error([case.cell for case in ladder], values, alike or not by_area)
        known = {"cells"} if error is not None else set()
        known |= {"inertia" for what, _, _ in pairs if what == "speed"}
        known |= {"base" for what, _, _ in pairs if "body." in what}
        parts = {"fit": fit_of(ladder[0].answer, key, known), "grid": error}
        for what, partner, case in pairs:
            if case.answer.get(key) is not None:
                changed = abs(case.answer[key] - partner.answer[key]) * factor_of(what, partner, case)
                parts[what] = max(parts.get(what) or 0.0, changed)
        bar = math.sqrt(sum(part**2 for part in parts.values() if part is not None))
        found.append(
            {
                "name": title,
                "key": key,
                "unit": unit,
                "value": values[0],
                "error_bar": bar,
                "parts": parts,
                "order": order,
            }
        )
    return found, missing


def print_table(found, ladder, pairs, missing):
    kinds = ["fit", "grid", *dict.fromkeys(what for what, _, _ in pairs)]
    print(
        f"{ladder[0].directory}: cells of "
        + ", ".join(f"{1e9 * case.cell:.4g}" for case in ladder)
        + " nm; shares of the error bar"
    )
    head = "".join(f"{kind:>{max(9, len(kind) + 4)}}" for kind in kinds)
    print(f"{'':<24}{'value':>10}{'':8}{'error bar':>12}{head}   order in the cell")
    for row in found:
        factor, unit = scaled(row["unit"], [row["value"]]) if row["unit"] else (1.0, "")
        if row["unit"] == "m2":
            factor, unit = 1e-12, "um2"
        text = (
            f"{row['name']:<24}{row['value'] / factor:>10.4g} {unit:<6} +- {row['error_bar'] / factor:>9.2g}"
        )
        for kind in kinds:
            part = row["parts"].get(kind)
            share = "-" if part is None or not row["value"] else f"{100 * part / abs(row['value']):.2g} %"
            text += f"{share:>{max(9, len(kind) + 4)}}"
        print(f"{text}   {row['order']}".rstrip())
    for sentence in missing:
        print(sentence)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN")
    parser.add_argument("--tool", default="")
    options = parser.parse_args()
    try:
        if len(options.runs) < 2:
            raise Wrong("one run has no error bar: say two or more, on other cells or at another speed")
        ladder, pairs = sort_out([Case(path, options.tool) for path in options.runs])
        found, missing = assess(ladder, pairs)
        if not found:
            raise Wrong("the runs have no number in common")
    except (Wrong, Unreadable) as error:
        print(f"error_bar: {error}", file=sys.stderr)
        return 2
    except senseless as error:
        print(f"error_bar: what a run wrote {why(error)}", file=sys.stderr)
        return 2
    print_table(found, ladder, pairs, missing)
    path = ladder[0].directory / ("error_bar.json" if not options.tool else f"error_bar_{options.tool}.json")
    path.write_text(
        json.dumps({"runs": [str(run) for run in options.runs], "quantities": found}, indent=1) + "\n"
    )
    print(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
