#!/usr/bin/env python3
"""An answer to a given accuracy, its price first: cheap runs on coarse cells, what they say of the error and of time, the cheapest
settings that should meet the target, and the run with these.

   solve.py --error PERCENT [options] SCENE          make solve SCENE=input/hertz.nml QUANTITY=load ERROR=2 BUDGET=600

The error is that of the quantity's curve: root mean square over its window, per cent of its largest value. It has parts of its own
measure each, and the prediction adds them up:

   space   order and size from three grids (Richardson); where they show no order, first order and twice the size
   time    twice what half the time step changes: first order in the step
   speed   twice what half the speed of tools and loads changes, where there are any

The size of the body, materials and what the scene leaves out are as it says: they are not varied. Under --out: chosen.nml, the scene that
was chosen, and answer.json. Exit status 0: the target is met; 1: the scene or the question is wrong; 3: the target was not met, and the
last line says what was. What was run stays and is not run again (as with study.py).
"""
import argparse
import json
import os
import sys
import time
from pathlib import Path

import numpy as np

import study_fit as fit
import study_quantity as quantities
from run_data import Unreadable
from study import Study
from study_runs import Rejected
from study_scene import BadSetting, scene_of

factors = (4, 3, 2, 1.5, 1, 2 / 3, 0.5, 1 / 3, 0.25, 1 / 6, 0.125)  # of the scene's own cell
least_ratio = 1.25   # of one pilot's cells to the next one's
margin = 0.8         # of the target that the prediction is to keep to
orders = 0.5, 2.5    # that are believed; others count as first order
again = 2            # runs beyond the pilots, at most


class Answer:
    """Pilots, what they say, and runs with what was chosen."""

    def __init__(self, study, target, seconds, say):
        self.study, self.target, self.left, self.say = study, target, seconds, say
        self.base = dict(study.setting.base)
        values = scene_of(study.text, self.base, study.setting).values()
        if "grid" not in values:
            raise BadSetting("the scene has no &grid")
        self.own = values["grid"][0]["cell_size"][0]
        self.safety = values.get("time", [{}])[0].get("safety", [0.35])[0]
        main = study.setting.families[0]
        known = [float(value) for value in main.values] if main.climb == "cell" else [2 * self.own]
        cells = {self.own * factor for factor in factors if self.own * factor < max(known)} | set(known)
        self.cells = []
        for cell in sorted(cells, reverse=True):
            if not self.cells or self.cells[-1] > cell * (1 + 1e-6):
                self.cells.append(cell)
        self.moves = any(group in values for group in ("tool", "pressure", "motion"))
        self.ladder, self.time, self.speed = [], 0.0, 0.0  # runs that differ in the cell alone; errors at own settings, per cent
        self.refused = ""

    def run(self, cell, safety=None, speed=1.0):
        """One run, or None where the program does not take it or it fails."""
        settings = {"cell": float(f"{cell:.12g}")}
        if safety is not None and safety != self.safety:
            settings["safety"] = safety
        if speed != 1:
            settings["speed"] = speed * self.base.get("speed", 1.0)
        try:
            run = self.study.run(settings)
            if not run.done:
                self.left -= run.go()
            if not run.good:
                self.refused = run.record["fault"]
                return None
            quantities.curve_of(run, self.study.quantity)
        except (Rejected, BadSetting) as error:
            self.refused = str(error)
            return None
        return run

    def curves(self, runs):
        """Of some runs on the same places."""
        found = [quantities.curve_of(run, self.study.quantity) for run in runs]
        x = quantities.places(self.study.quantity, found)
        return [quantities.at(self.study.quantity, curve, x) for curve in found]

    def apart(self, one, other):
        """Rms difference of two runs, per cent of the largest value."""
        a, b = self.curves([one, other])
        if not np.max(np.abs(b)) > 0:
            raise Unreadable(f"{other.directory}: the quantity is 0 all the way where curves are compared")
        return 100 * float(np.sqrt(np.mean((a - b)**2)) / np.max(np.abs(b)))

    def pilots(self):
        """Runs on the coarsest cells that will do, three at least and more until they show an order, as far as a quarter of the
        budget goes; and one each with half the step and half the speed."""
        enough = 0.75 * self.left
        for cell in self.cells:
            if len(self.ladder) >= 3 and (self.left < enough or self.shows_order()
                                          or self.space()[0] <= margin * self.target):
                break
            if self.ladder and self.ladder[-1].cell_size < cell * least_ratio:
                continue
            run = self.run(cell)
            if run is None or not np.max(np.abs(self.curves([run])[0])) > 0:
                continue
            run.cell_size = cell
            self.ladder.append(run)
            self.say(f"pilot: cells of {cell:.4g} m, {run.record['seconds'][-1]:.2f} s")
        if len(self.ladder) < 3:
            raise Unreadable(f"only {len(self.ladder)} of three pilot runs have ended well; the last sentence: {self.refused}")
        middle = self.ladder[-2]
        finer = self.run(middle.cell_size, safety=0.5 * self.safety)
        if finer:
            self.time = 2 * self.apart(middle, finer)
        slower = self.run(middle.cell_size, speed=0.5) if self.moves else None
        if slower:
            self.speed = 2 * self.apart(middle, slower)
        self.time_cell = middle.cell_size

    def shows_order(self):
        return self.space()[3].startswith("order")

    def space(self):
        """Error (per cent) of the finest run of the ladder, its uncertainty, the order, and how that was found."""
        last = sorted(self.ladder, key=lambda run: -run.cell_size)[-3:]
        cells, curves = [run.cell_size for run in last], self.curves(last)
        scale = np.max(np.abs(curves[-1]))
        step = 100 * float(np.sqrt(np.mean((curves[-1] - curves[-2])**2)) / scale)
        ratio = cells[-2] / cells[-1]
        by_first = step / (ratio - 1)
        try:
            _, order = fit.richardson(cells, curves)
        except fit.NoOrder as reason:
            return 2 * by_first, 2 * by_first, 1.0, f"first order, assumed, and twice its size: {reason}"
        if not orders[0] <= order <= orders[1]:
            return 2 * by_first, 2 * by_first, 1.0, f"first order, assumed, and twice its size: the grids show {order:.2f}"
        error = step / (ratio**order - 1)
        return error, abs(by_first - error), order, f"order {order:.2f} of three grids"

    def model(self):
        """Functions of (cell, safety, speed): error and its parts (per cent), core-seconds, MB."""
        error, _, order, _ = self.space()
        finest = min(self.ladder, key=lambda run: run.cell_size)
        runs = [run for run in self.ladder if run.seconds > 0]
        slope = 4.0
        if len(runs) > 1 and max(run.seconds for run in runs) > 0.5:  # start and end do not count there
            last = sorted(runs, key=lambda run: -run.cell_size)[-2:]
            slope = min(max(-fit.fitted_order([run.cell_size for run in last], [run.seconds for run in last]), 3.0), 4.5)
        measured = sorted((run.cell_size, run.seconds) for run in runs)

        def parts(cell, safety, speed):
            return {"space": error * (cell / finest.cell_size)**order,
                    "time": self.time * (safety / self.safety) * (cell / self.time_cell), "speed": self.speed * speed}

        def seconds(cell, safety, speed):
            if cell >= finest.cell_size:  # between pilots
                at_own = np.exp(np.interp(np.log(cell), *np.log(measured).T))
            else:
                at_own = finest.seconds * (finest.cell_size / cell)**slope
            return float(at_own) * self.safety / safety / speed

        def megabytes(cell):
            return (finest.record.get("megabytes") or 0.0) * (finest.cell_size / cell)**3

        return parts, seconds, megabytes

    def choose(self):
        """The cheapest settings that should meet the target, or, where the budget does not reach, the best that it buys."""
        parts, seconds, megabytes = self.model()
        offers = [(seconds(cell, safety, speed), sum(parts(cell, safety, speed).values()), cell, safety, speed)
                  for cell in self.cells for safety in (self.safety, 0.5 * self.safety)
                  for speed in ((1.0, 0.5, 0.25, 0.125) if self.speed > 0 else (1.0,))]
        meeting = [offer for offer in offers if offer[1] <= margin * self.target]
        wanted = min(meeting) if meeting else None
        if wanted is None or wanted[0] > self.left:
            within = [offer for offer in offers if offer[0] <= self.left]
            best = min(within, key=lambda offer: offer[1]) if within else None
            return wanted, best
        return wanted, wanted

    def told(self, offer):
        parts, seconds, megabytes = self.model()
        cost, error, cell, safety, speed = offer
        shares = ", ".join(f"{name} {share:.2g} %" for name, share in parts(cell, safety, speed).items())
        return (f"cells of {cell:.4g} m, safety {safety:g}, speed {speed:g}: error {error:.2g} % ({shares}), {cost:.3g} core-s, "
                f"{megabytes(cell):.3g} MB")


def achieved(answer, offer, run):
    """Error of a run, per cent, and its uncertainty: space from the grids with its own, time and speed as measured."""
    _, _, cell, safety, speed = offer
    if run not in answer.ladder and safety == answer.safety and speed == 1:
        run.cell_size = cell
        answer.ladder.append(run)
    parts, _, _ = answer.model()
    error, uncertainty, _, how = answer.space()
    finest = min(answer.ladder, key=lambda one: one.cell_size)
    if finest.cell_size > cell * (1 + 1e-9):  # the run itself is not one of the grids: what they predict for it
        uncertainty *= parts(cell, safety, speed)["space"] / max(error, 1e-300)
    shares = parts(cell, safety, speed)
    return sum(shares.values()), uncertainty + 0.5 * (shares["time"] + shares["speed"]), shares, how


def solve(options, say):
    study = Study(options)
    study.directory = (options.out or Path("out/solve") / options.scene.stem).resolve()
    study.directory.mkdir(parents=True, exist_ok=True)
    answer = Answer(study, options.error, options.budget, say)
    say(f"{study.setting.title}: {study.quantity.name} to {options.error:g} %, within {options.budget:g} s")
    answer.pilots()
    error, uncertainty, order, how = answer.space()
    say(f"space: {error:.2g} +- {uncertainty:.2g} % with cells of {answer.ladder[-1].cell_size:.4g} m ({how})")
    say(f"time step: {answer.time:.2g} %; speed: {answer.speed:.2g} % as given; size of the body: as given")
    predicted, result = None, None
    for attempt in range(again):
        wanted, offer = answer.choose()
        say("predicted for the target: " + (answer.told(wanted) if wanted else "none of the settings that are tried meets it"))
        if offer is None:
            say(f"the budget is used up: {answer.left:.0f} s are left")
            break
        if offer is not wanted:
            say(f"that is beyond the {answer.left:.0f} s that are left; the best within them: " + answer.told(offer))
        start = time.monotonic()
        run = answer.run(*offer[2:])
        if run is None:
            say(f"the run with cells of {offer[2]:.4g} m did not end well: {answer.refused}")
            answer.cells = [cell for cell in answer.cells if cell != offer[2]]
            continue
        predicted = offer[0]
        result = (offer, run, *achieved(answer, offer, run))
        say(f"run: {run.seconds:.3g} core-s where {predicted:.3g} were predicted, {time.monotonic() - start:.3g} s by the clock")
        say(f"error: {result[2]:.2g} +- {result[3]:.2g} % ({result[5]})")
        if result[2] <= options.error or offer is not wanted:
            break
    return study, answer, result, predicted


def write(options, study, answer, result, predicted, say):
    offer, run, error, uncertainty, shares, how = result
    scene = scene_of(study.text, run.settings, study.setting)
    chosen = study.directory / "chosen.nml"
    chosen.write_text(scene.text)
    curve = quantities.curve_of(run, study.quantity)
    met = error <= options.error
    facts = {"quantity": study.quantity.name, "target": options.error, "met": bool(met), "error": error, "error_uncertainty": uncertainty,
             "shares": shares, "space_found_by": how, "seconds": run.seconds, "predicted_seconds": predicted,
             "megabytes": run.record.get("megabytes"), "settings": run.settings, "last_value": float(curve[1][-1]),
             "largest_value": float(np.max(np.abs(curve[1]))), "run": str(run.directory)}
    partial = study.directory / "answer.json.part"
    partial.write_text(json.dumps(facts, indent=1) + "\n")
    os.replace(partial, study.directory / "answer.json")
    say(f"{study.quantity.name}: {facts['last_value']:.6g} at the end; {chosen} and answer.json are written")
    if met:
        say(f"the target of {options.error:g} % is met: {error:.2g} +- {uncertainty:.2g} %")
    else:
        say(f"the target of {options.error:g} % is NOT met: {error:.2g} +- {uncertainty:.2g} % is what the budget gave")
    return 0 if met else 3


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--quantity", default="", help="one of the study's setting, or load or energy")
    parser.add_argument("--error", type=float, required=True, help="per cent")
    parser.add_argument("--budget", type=float, default=600.0, help="seconds of the clock for all runs (600)")
    parser.add_argument("--ranks", type=int, default=0)
    parser.add_argument("--setting", type=Path, help="another file than NAME.toml or studies/NAME.toml beside the scene")
    parser.add_argument("--out", type=Path, help="out/solve/NAME when not given")
    parser.add_argument("--program", type=Path, default=Path("gimp3d"))
    parser.add_argument("--build", type=Path, default=Path("build/opt"))
    parser.add_argument("--launch", default=os.environ.get("MPIRUN", "mpirun"))
    return parser.parse_args()


def main():
    options = arguments()

    def say(text):
        print(text, flush=True)

    try:
        if not options.scene.is_file():
            raise Unreadable(f"{options.scene}: no such scene")
        if not options.error > 0 or not options.budget > 0:
            raise BadSetting("ERROR (per cent) and BUDGET (seconds) must be above 0")
        study, answer, result, predicted = solve(options, say)
        if result is None:
            say(f"the target of {options.error:g} % is NOT met: no run beyond the pilots")
            return 3
        return write(options, study, answer, result, predicted, say)
    except (BadSetting, Rejected, Unreadable) as error:
        print(f"solve: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
