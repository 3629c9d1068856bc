#!/usr/bin/env python3
"""What accuracy costs in a scene: runs it over ladders of cell size and of other knobs, beside a reference.

   study.py [options] SCENE          make study SCENE=input/hertz.nml QUANTITY=load

What is climbed stands in NAME.toml or studies/NAME.toml beside SCENE (NAME.nml); without that file, ladders
by default and Richardson's limit of the three finest grids as the reference. Under --out: study.csv (every
run: error, core-seconds, memory), study.png (error over core-seconds, the Pareto front marked), shares.csv
(what halving each thing by itself changes), comparisons.csv (families at equal error), answers.txt; study.json
has all of it. What was
run stays and is not run again while scene and program are the same: an interrupted study goes on.

Core-seconds are those of the time loop without the writing of files, times the ranks: medians of --repeats as
far as --budget allows."""

import argparse
import hashlib
import json
import os
import shlex
import sys
from pathlib import Path

import numpy as np

if sys.version_info < (3, 11):
    sys.exit("study.py needs Python 3.11 or later")

from . import study_fit as fit
from . import study_quantity as quantities
from . import study_report as report
from . import study_setting
from .run_data import Unreadable, senseless, text_in, why
from .study_runs import Budget, Rejected, Run, described, session
from .scene_text import BadSetting, Scene


class Study:
    """A scene, its setting, and the runs made for it: the same settings, the same run."""

    def __init__(self, options):
        self.scene = options.scene
        self.text = text_in(options.scene)
        for group in ("output", "checkpoint"):  # runs of a study have their own
            count = len(Scene(self.text).groups(group))
            if count > 1:
                raise BadSetting(f"{options.scene}: {count} groups &{group}; allowed: 0 or 1")
        folder, name = options.scene.parent, f"{options.scene.stem}.toml"
        beside = [path for path in (folder / name, folder / "studies" / name) if path.is_file()]
        self.setting_path = options.setting or (beside[0] if beside else None)
        if self.setting_path:
            self.setting, self.quantities = study_setting.read(self.setting_path)
        else:
            self.setting, self.quantities = study_setting.by_default(self.text, options.quantity)
        name = options.quantity or next(iter(self.quantities))
        if name not in self.quantities:
            raise BadSetting(f"QUANTITY={name}: there are {', '.join(self.quantities)}")
        self.quantity = self.quantities[name]
        self.directory = options.out or Path("out/study") / options.scene.stem
        self.directory = self.directory.resolve()
        self.directory.mkdir(parents=True, exist_ok=True)
        self.ranks = options.ranks or self.setting.ranks
        self.launch = shlex.split(options.launch)
        self.program = (
            options.build / self.setting.program if self.setting.program else options.program
        ).resolve()
        if not self.program.is_file():
            raise Unreadable(f"{self.program}: no such program; `make` builds it")
        self.program_hash = hashlib.sha256(self.program.read_bytes()).hexdigest()
        self.runs = {}
        self.sections = {}  # text of a scene: that of its section, or why it has none

    def run(self, settings):
        run = Run(self, settings)
        return self.runs.setdefault(run.directory, run)


class Plan:
    """All runs of a study: families, the reference's own, those of the shares."""

    def __init__(self, study):
        self.study, setting = study, study.setting
        self.families = {
            family.name: [study.run(rung) for rung in family.rungs()] for family in setting.families
        }
        self.climbs = {family.name: family.climb for family in setting.families}
        self.main = setting.families[0].name
        wanted = study.quantity.reference
        self.reference = study.run(wanted) if isinstance(wanted, dict) else None
        self.about, self.other = self.middle_of_shares()
        self.shares = {}
        if self.about:
            self.shares = {
                name: study.run({**self.about.settings, **better}) for name, better in setting.shares.items()
            }

    def middle_of_shares(self):
        """The run that shares stand about (the last but one of the main family when nothing is said), and one
        that differs from it in the cell: the next coarser with the time step of the first, or, where there is
        none, the next finer with its own."""
        ladder = sorted(self.families[self.main], key=lambda run: run.cell)
        about = (
            self.study.run(self.study.setting.about)
            if self.study.setting.about
            else ladder[1]
            if len(ladder) > 1
            else None
        )
        if about is None:
            return None, None
        others = [
            run
            for runs in self.families.values()
            for run in runs
            if {**run.settings, "cell": 0} == {**about.settings, "cell": 0}
        ]
        coarser = [run for run in others if run.cell > about.cell * (1 + 1e-9)]
        finer = [run for run in others if run.cell < about.cell * (1 - 1e-9)]
        if coarser:
            one = min(coarser, key=lambda run: run.cell)
            same_step = about.safety * about.cell / one.cell
            return about, self.study.run({**one.settings, "safety": float(f"{same_step:.6g}")})
        return (about, max(finer, key=lambda run: run.cell)) if finer else (None, None)

    def all(self):
        planned = [(family, run) for family, runs in self.families.items() for run in runs]
        if self.reference:
            planned.insert(0, ("reference", self.reference))
        if self.about:
            planned += [("shares", run) for run in (self.about, self.other, *self.shares.values())]
        return planned


class Comparison:
    """Curves of all runs beside the reference: each run's error, rms and largest, per cent."""

    def __init__(self, study, plan):
        self.quantity = quantity = study.quantity
        self.good = list(dict.fromkeys(run for _, run in plan.all() if run.good))
        if not self.good:
            raise Unreadable("no run of the study has ended well")
        self.curves = {run: quantities.curve_of(run, quantity) for run in self.good}
        self.notes, self.limit, self.order = [], None, None
        known = quantities.reference_of(
            quantity, self.good, study.setting_path.parent if study.setting_path else Path(".")
        )
        self.name, self.known = known if known else ("", None)
        table = self.known if isinstance(self.known, tuple) else None
        self.x = quantities.places(
            quantity, self.curves.values(), table if table and len(table[0]) > 1 else None
        )
        self.y = {run: quantities.at(quantity, curve, self.x) for run, curve in self.curves.items()}
        self.unknown = None  # a run that is itself the reference
        self.finest = 0.0  # its cell, where nothing finer tells what other runs on it have, m
        if known is None:
            self.limit = self.own_reference(plan)
        self.scale = (
            1.0 if quantity.kind == "printed" else float(np.max(np.abs(self.reference(self.good[0]))))
        )
        if self.scale == 0.0:
            raise BadSetting(
                f"quantity {quantity.name}: {self.name} is 0 wherever it is compared, so that no error in "
                "per cent of it can be had"
            )
        self.errors = {run: self.error(run) for run in self.good}
        self.balances = {run: quantities.worst_balance(run) for run in self.good}
        limit = study.setting.balance_limit
        self.trusted = {run for run in self.good if self.balances[run] is None or self.balances[run] <= limit}

    def own_reference(self, plan):
        """Of a run, or Richardson's limit of the main family; its finest run where that shows no order, and a
        note says so."""
        if plan.reference:
            if not plan.reference.good:
                raise Unreadable(
                    "the run that is the reference is not there: more --budget, or see what it said"
                )
            self.name, self.unknown = f"the run with {plan.reference.said}", plan.reference
            return self.y[plan.reference]
        ladder = [run for run in plan.families[plan.main] if run.good]
        if not ladder:
            raise Unreadable(f"no run of {plan.main} has ended well: there is no reference")
        try:
            limit, self.order = fit.richardson([run.cell for run in ladder], [self.y[run] for run in ladder])
            self.name = f"Richardson's limit of {plan.main} (order {self.order:.2f})"
            return limit
        except fit.NoOrder as reason:
            self.unknown = min(ladder, key=lambda run: run.cell)
            self.name = f"the finest run of {plan.main}"
            self.notes.append(
                f"Richardson's limit is not to be had ({reason}): errors are those beside the finest run of "
                f"{plan.main}; its own is not known, nor those of other runs on its cells."
            )
            self.finest = self.unknown.cell
            return self.y[self.unknown]

    def reference(self, run):
        """On the places where curves are compared."""
        if self.limit is not None:
            return self.limit
        if isinstance(self.known, tuple):
            x, y = self.known
            return y if len(x) == 1 else np.interp(self.x, x, y)
        if self.quantity.kind == "load":
            return self.known(self.x)
        x, y = self.known(run, self.quantity)
        return np.interp(self.x, x, y)

    def error(self, run):
        if run is self.unknown or run.cell <= self.finest * (1 + 1e-9):
            return None, None
        if self.quantity.kind == "printed":
            return (100 * abs(float(self.y[run][0])),) * 2
        return fit.norms(self.y[run], self.reference(run))

    def change(self, one, other):
        """Rms difference of two runs, per cent of the reference's largest."""
        return 100 * float(np.sqrt(np.mean((self.y[one] - self.y[other]) ** 2))) / self.scale


def table_of(plan, comparison, front_runs):
    """One row a run and family."""
    rows = []
    for family, runs in [*plan.families.items(), ("reference", [plan.reference] if plan.reference else [])]:
        for run in sorted(runs, key=lambda run: -run.cell):
            error, largest = comparison.errors.get(run, (None, None))
            record = run.record
            rows.append(
                {
                    "family": family,
                    "settings": run.said,
                    "cell": run.cell,
                    "particles": record.get("particles"),
                    "steps": record.get("steps"),
                    "ranks": run.study.ranks,
                    "megabytes": record.get("megabytes"),
                    "core_seconds": run.seconds if run.good else None,
                    "repeats": len(record["seconds"]),
                    "spread_percent": run.spread if run.good else None,
                    "error_percent": error,
                    "largest_percent": largest,
                    "balance_percent": comparison.balances.get(run),
                    "on_front": int(run in front_runs),
                    "fault": record["fault"] or ("" if run.done else "left out: budget"),
                }
            )
    return rows


def shares_of(plan, comparison, order):
    """What halving one thing changes about one run, per cent of the reference's largest, and of the sum of
    all."""
    if not (plan.about and plan.about.good and plan.other.good):
        return []
    change = comparison.change(plan.about, plan.other)
    if order and order > 0.2:
        change = fit.halved(order, plan.about.cell, plan.other.cell, change)
    step = "same time step" if plan.other.cell > plan.about.cell else "and time step"
    rows = [
        {
            "share": "space",
            "knob": f"cell halved (measured to {plan.other.cell:.4g}, {step})",
            "change_percent": change,
        }
    ]
    for name, run in plan.shares.items():
        if run.good:
            better = {
                knob: value for knob, value in run.settings.items() if plan.about.settings.get(knob) != value
            }
            rows.append(
                {
                    "share": name,
                    "knob": described(better),
                    "change_percent": comparison.change(plan.about, run),
                }
            )
    total = sum(row["change_percent"] for row in rows)
    for row in rows:
        row["share_percent"] = 100 * row["change_percent"] / total if total > 0 else None
    return rows


def compared(plan, comparison, fronts):
    """Families at equal error: time and memory of the first over the second's."""
    rows = []
    for one, other in plan.study.setting.comparisons:
        time = fit.ratio_at_equal_error(*fronts["seconds"][one, other])
        memory = fit.ratio_at_equal_error(*fronts["megabytes"][one, other])
        rows.append(
            {
                "family": one,
                "beside": other,
                "time_ratio": time and time[0],
                "least": time and time[1],
                "most": time and time[2],
                "error_from_percent": time and time[3][0],
                "error_to_percent": time and time[3][1],
                "memory_ratio": memory and memory[0],
            }
        )
    return rows


def front_of(comparison, runs, cost):
    chosen = [
        run
        for run in runs
        if run in comparison.trusted and comparison.errors[run][0] is not None and cost(run)
    ]
    return fit.Front([cost(run) for run in chosen], [comparison.errors[run][0] for run in chosen])


def assess(study, plan):
    """All tables and sentences from the runs that are there."""
    comparison = Comparison(study, plan)
    in_families = list(dict.fromkeys(run for runs in plan.families.values() for run in runs if run.good))
    judged = [run for run in in_families if comparison.errors[run][0] is not None]
    sound = [run for run in judged if run in comparison.trusted]
    front_runs = [
        sound[i]
        for i in fit.pareto([run.seconds for run in sound], [comparison.errors[run][0] for run in sound])
    ]
    front = front_of(comparison, judged, lambda run: run.seconds)
    orders = {}
    for family, runs in plan.families.items():
        known = [run for run in runs if run in judged]
        if plan.climbs[family] == "cell":
            orders[family] = fit.fitted_order(
                [run.cell for run in known], [comparison.errors[run][0] for run in known]
            )
    fronts = {"seconds": {}, "megabytes": {}}
    costs = {"seconds": lambda run: run.seconds, "megabytes": lambda run: run.record.get("megabytes")}
    for pair in study.setting.comparisons:
        for cost, of in costs.items():
            fronts[cost][pair] = tuple(front_of(comparison, plan.families[family], of) for family in pair)
    shares = shares_of(plan, comparison, orders.get(plan.main))
    pairs = compared(plan, comparison, fronts)
    rows = table_of(plan, comparison, front_runs)
    return comparison, rows, orders, front, shares, pairs, judged, front_runs


def sentences(study, plan, results):
    comparison, rows, orders, front, shares, pairs, judged, front_runs = results
    quantity = study.quantity
    said = [
        f"{study.setting.title}: {quantity.name} beside {comparison.name}"
        + (f", itself known to {quantity.reference_error:g} %" if quantity.reference_error else "")
        + "."
    ]
    said += comparison.notes
    if len(front.costs) == 0:
        return said + ["There is no run whose error is known and whose energy balance holds."]
    said += [report.cost_sentence(front, target) for target in study.setting.targets]
    said += [
        report.budget_sentence(front, seconds, quantity.reference_error) for seconds in study.setting.budgets
    ]
    fitted = [f"{family} {order:.2f}" for family, order in orders.items() if order is not None]
    if fitted:
        said.append("Fitted orders of the error in the cell: " + ", ".join(fitted) + ".")
    if shares:
        said.append(
            f"About {plan.about.said or 'the scene as given'}: "
            + "; ".join(f"{row['share']} {row['change_percent']:.2g} % ({row['knob']})" for row in shares)
            + "."
        )
    for row in pairs:
        if row["time_ratio"] is None:
            said.append(f"{row['family']} and {row['beside']} have no error in common.")
        else:
            said.append(
                f"{row['family']} at equal error ({row['error_from_percent']:.2g} to "
                f"{row['error_to_percent']:.2g} %): "
                f"{row['time_ratio']:.2g} of the time of {row['beside']} ({row['least']:.2g} to "
                f"{row['most']:.2g})"
                + (f", {row['memory_ratio']:.2g} of its memory." if row["memory_ratio"] else ".")
            )
    unsound = sum(run not in comparison.trusted for run in judged)
    if unsound:
        said.append(
            "Runs that are not taken for the front or for comparisons, as their energy balance is off by "
            f"more than {study.setting.balance_limit:g} %: {unsound}."
        )
    spreads = [run.spread for run in judged if run.spread is not None]
    once = sum(len(run.record["seconds"]) == 1 for run in judged)
    noise = (
        f"; their repeats differ by {np.median(spreads):.0f} % (median), {max(spreads):.0f} % at most."
        if spreads
        else "."
    )
    said.append(
        f"Times are medians of up to {max(len(run.record['seconds']) for run in judged)} runs"
        + (f", {once} of {len(judged)} were run once" if once else "")
        + noise
    )
    if {stamp for run in judged for stamp in run.record["sessions"]} - {session}:
        said.append(
            "Some of them are of an earlier session: their times may be of another state of the machine."
        )
    return said


# in the folder of a quantity
written = "study.csv", "study.png", "shares.csv", "comparisons.csv", "answers.txt", "study.json"


def clear(folder, names):
    """Take files of an earlier command out of a folder: none may be taken for an answer of this one."""
    for name in names:
        (folder / name).unlink(missing_ok=True)


def write(study, plan, results):
    comparison, rows, orders, front, shares, pairs, judged, front_runs = results
    folder = study.directory / study.quantity.name
    folder.mkdir(exist_ok=True)
    report.write_csv(folder / "study.csv", rows)
    if shares:
        report.write_csv(folder / "shares.csv", shares)
    if pairs:
        report.write_csv(folder / "comparisons.csv", pairs)
    points = {
        family: [(run.seconds, comparison.errors[run][0], run in front_runs) for run in runs if run in judged]
        for family, runs in plan.families.items()
    }
    report.diagram(
        folder / "study.png",
        f"{study.setting.title}: {study.quantity.name}",
        {family: ones for family, ones in points.items() if ones},
        (front.costs, front.errors),
        study.quantity.reference_error,
        orders,
    )
    said = sentences(study, plan, results)
    report.write_text(folder / "answers.txt", "\n".join(said) + "\n")
    record = {
        "scene": str(study.scene),
        "title": study.setting.title,
        "quantity": study.quantity.name,
        "reference": comparison.name,
        "reference_error_percent": study.quantity.reference_error,
        "runs": rows,
        "orders": orders,
        "front": {
            "core_seconds": list(map(float, front.costs)),
            "error_percent": list(map(float, front.errors)),
        },
        "shares": shares,
        "comparisons": pairs,
        "answers": said,
        "directory": str(folder),
    }
    report.write_text(folder / "study.json", json.dumps(record, indent=1) + "\n")
    print(
        report.markdown(
            rows,
            [
                ("family", "family"),
                ("settings", "settings"),
                ("particles", "particles"),
                ("steps", "steps"),
                ("megabytes", "MB"),
                ("core_seconds", "core-s"),
                ("repeats", "runs"),
                ("error_percent", "error [%]"),
                ("largest_percent", "largest [%]"),
                ("balance_percent", "balance [%]"),
                ("on_front", "front"),
                ("fault", ""),
            ],
        )
    )
    if shares:
        print(
            report.markdown(
                shares,
                [
                    ("share", "share"),
                    ("knob", "changed"),
                    ("change_percent", "change [%]"),
                    ("share_percent", "share [%]"),
                ],
            )
        )
    print("\n".join(said))
    print(f"\n{folder}: " + ", ".join(sorted(path.name for path in folder.iterdir())))
    return record


class NoAnswer(Exception):
    """There is nothing to say; the text says why, `status` is that of the command."""

    def __init__(self, status, sentence):
        super().__init__(sentence)
        self.status = status


def arguments(words=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", type=Path)
    parser.add_argument("--quantity", default="", help="one of the setting's; the first when not given")
    parser.add_argument(
        "--budget",
        type=float,
        default=300.0,
        help="seconds of the clock for runs that are not there yet (300); 0: none is made",
    )
    parser.add_argument(
        "--repeats", type=int, default=3, help="runs of each rung that medians are taken of (3)"
    )
    parser.add_argument("--ranks", type=int, default=0, help="of each run (what the setting says, else 1)")
    parser.add_argument(
        "--setting", type=Path, help="another file than NAME.toml or studies/NAME.toml beside the scene"
    )
    parser.add_argument("--out", type=Path, help="out/study/NAME when not given")
    parser.add_argument(
        "--program",
        type=Path,
        default=Path(os.environ.get("GIMP3D") or "gimp3d"),
        help="the environment's GIMP3D, else ./gimp3d",
    )
    parser.add_argument(
        "--build", type=Path, default=Path("build/opt"), help="where the setting's own program stands"
    )
    parser.add_argument(
        "--launch",
        default=os.environ.get("MPIRUN", "mpirun"),
        help="what starts runs; -n RANKS PROGRAM follows",
    )
    return parser.parse_args(words)


def find(options):
    """The study as a dictionary; its files are written, its tables printed. Raises NoAnswer."""
    try:
        if not options.scene.is_file():
            raise Unreadable(f"{options.scene}: no such scene")
        if options.budget < 0 or options.repeats < 1 or options.ranks < 0:
            raise BadSetting("--budget must be at least 0, --repeats at least 1, --ranks at least 1")
        try:
            study = Study(options)
            plan = Plan(study)
        except senseless as error:
            raise Unreadable(f"{options.scene}, or the file of its study: the scene {why(error)}")
        clear(study.directory / study.quantity.name, written)
        budget = Budget(options.budget, lambda text: print(text, flush=True))
        budget.first_pass(plan.all())
        budget.repeats(
            list(dict.fromkeys(run for runs in plan.families.values() for run in runs)), options.repeats
        )
        return write(study, plan, assess(study, plan))
    except (BadSetting, Rejected, Unreadable) as error:
        raise NoAnswer(2, str(error)) from None


def main():
    try:
        find(arguments())
    except NoAnswer as reason:
        print(f"study: {reason}", file=sys.stderr)
        return reason.status
    return 0


if __name__ == "__main__":
    sys.exit(main())
