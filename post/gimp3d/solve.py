#!/usr/bin/env python3
"""Ask for an accuracy: what it takes is printed before anything long begins, and what was reached behind it.

   solve.py [options] SCENE          make solve SCENE=input/hertz.nml QUANTITY=load ERROR=1 BUDGET=600

1. Three cheap runs on coarse grids, one at another speed, one with another time step, one with a larger body, one
in which particles fill curved bodies otherwise: the parts of the error and their orders, and what is open. Of a
body of revolution these runs are those of its section (gimp3d --section), and one of the scene itself beside
them tells what the section does not.
2. The cheapest settings (cell, speed, time step; with the levels of the scene, or of the study's file beside
   it) that are predicted to meet ERROR (per cent, rms over the window of the quantity, of its largest value),
   with their predicted time and memory. Where they do not fit into BUDGET (seconds of the clock), what it
   buys instead is said, and nothing long is run.
3. The run, and the error that it has, from all grids together, with its uncertainty. Where that misses the
   target, the next finer settings are tried, as long as the budget lasts.

Under out/solve/NAME: chosen.nml (the scene that was chosen, with its outputs), answer.json (error,
error_uncertainty, seconds, predicted_seconds, ...). Runs stay and are not run again. Exit status 0: the
target is met; 1: it is not, and why is said; 2: the scene or what was asked cannot be used.

The speed is changed only where it is no part of the problem: tools and pressures are prescribed, bodies are
at rest at the start, and no material depends on the rate. The answer is then that of infinitely slow loading.
The body is as large as the scene says, and by how much a half-space would differ is said beside the error;
with --half-space that is a part of the error, and the body is chosen too."""

import argparse
import itertools
import json
import math
import os
import re
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

if sys.version_info < (3, 11):
    sys.exit("solve.py needs Python 3.11 or later")

from . import study_quantity as quantities
from .run_data import Unreadable, depth_of, read_namelists, senseless, why
from .scene_text import BadSetting, Scene, is_flat
from .solve_model import Choice, Errors, MARGIN, Price, Sample, choose
from .study import Study, clear
from .study_body import size_of
from .study_report import write_text
from .study_runs import NoSection, Rejected, notes_of, share_of_processors
from .study_scene import is_curved, scene_of, side_that_moves
from .systematic import rate_free

FACTORS = [4, 3, 2, 4 / 3, 1, 2 / 3, 0.5, 1 / 3, 0.25]  # of the scene's cell, or those of the study's file
SPEEDS = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125]
STEPS = [1.0, 0.5]
BODIES = [1.0, 1.5, 2.0, 3.0, 4.0]
LEAST_LARGER = 1.1  # a body of less than that shows too little
LARGER = 1.5  # size of the body of the pilot that shows what its ends do
PILOT = 0.05  # of the budget: a grid that is tried for less is a pilot
SEARCH = 0.2  # of the budget: the same while the grids show no order; three are made in any case
PILOTS = 0.4  # of the budget: no further grid is tried that would bring all of them beyond
SHARPER = 0.5  # of what is left of it: a pilot that is added after a miss
ROUNDS = 3
# Of the difference that whole particles make, where bodies are filled by shares: a sphere between plates is
# then -1 to +6 % off, with whole particles 13 to 90 % more (4 to 2 cells to the radius of the contact)
SHARES = 0.25
ENOUGH = 0.5  # of the target: pilots whose error in space is less end; speed and time step come on top
YARDSTICK = 0.05  # of a run: what may be spent on a pilot before it, and after it, to see the machine's pace


class Unusable(Exception):
    """Settings that the program does not take, or that end in a numerical fault; the text says why."""


class Missed(Exception):
    """The target is not to be had; the text says what is."""


class Planned:
    """What `mode='plan'` says of settings; `fault`: the program's own sentence where it does not take
    them."""

    def __init__(self, study, settings):
        scene = study.run(settings).make_scene()
        scene.set("scene", "mode", "plan")
        plan = study.directory / "plan.json"
        plan.unlink(missing_ok=True)
        done = subprocess.run(
            [*study.launch, "-n", str(study.ranks), str(study.program), "--json", plan.name],
            input=scene.text,
            cwd=study.directory,
            capture_output=True,
            text=True,
        )
        self.fault = "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["no sentence"])[-1]
        if self.fault:
            return
        figures = json.loads(plan.read_text())
        self.updates, self.steps = figures["particle_steps"], figures["steps"]
        seconds = figures["time_s"] - figures["output_s"]
        self.seconds = study.ranks * seconds * share_of_processors(figures["processor_share"], study)
        self.megabytes = 1e-6 * figures["memory_B"]


class Key(NamedTuple):
    """Settings of a run. The grid is named by its finest cell: so the same factor with more levels has a
    coarser first grid."""

    factor: float  # of the scene's finest cell
    levels: int
    speed: float = 1.0  # of all that is prescribed
    step: float = 1.0  # of the scene's time step
    body: float = 1.0  # size, over that of the scene
    fill: str = ""  # of curved bodies, where it is not the scene's
    section: bool = False  # a pilot that is given by its section

    @property
    def grid(self):
        return self.factor, self.levels, self.section

    @property
    def is_plain(self):
        return self.speed == self.step == self.body == 1.0 and not self.fill

    def is_like(self, other):
        """A particle-step of both costs the same, about: as many levels, as large a body."""
        return (self.levels, self.body, self.section) == (other.levels, other.body, other.section)


class Solve:
    """The scene, and the runs made so far."""

    def __init__(self, study, options):
        self.study, self.options, self.quantity = study, options, study.quantity
        self.base = dict(study.setting.base)
        case = self.case = scene_of(study.text, self.base, study.setting).values()
        self.cell = case["grid"][0]["cell_size"][0]
        self.own = depth_of(case)  # levels of the scene
        self.factors = study.setting.factors or FACTORS
        self.most = self.own + len(study.setting.level_boxes)
        self.speeds = speed_is_free(case)
        self.time_step = time_step_of(case)
        if self.quantity.kind == "load":
            quantities.tool_of(case, self.quantity)  # refused before any run where there is none
        self.started = time.monotonic()
        self.done = {}  # Key: run
        self.refused = set()  # by the program: grids of keys, or a Key at another speed or step
        self.planned = {}  # (levels, body): (Key, Planned), for what has no run yet
        self.measured = {}  # Key: error of a run, per cent
        self.confirmed = {}  # Key: core-seconds, MB, by a plan of it
        self.larger = None  # Key of the pilot with a larger body
        self.no_larger = ""  # why there is no run of it
        self.other_surface = None  # Key of the pilot with curved bodies filled otherwise
        self.correction = None  # of plans: what a pilot took over what its own plan says
        self.quarter = None  # Key of the finest pilot that is no section, where the others are
        self.no_section = self.against_sections(case)  # why pilots are not given by their section
        self.flat = not self.no_section

    def against_sections(self, case):
        """Why pilots are runs of the scene itself; '' where its section stands for it."""
        if self.options.no_section:
            return "--no-section"
        if is_flat(case["grid"][0]):
            return "the scene is given by its section"
        if self.quantity.kind not in ("load", "energy"):
            return f"a quantity of the kind {self.quantity.kind} is one of places in 3D"
        try:
            section = self.study.run({**self.base, "section": True}).case
        except BadSetting as fault:
            return str(fault)
        if section["grid"][0]["geometry"][0] != "axisymmetric":
            return "it would be one of plane strain, for which a thin slice does as well"
        return ""

    def left(self):
        return self.options.budget - (time.monotonic() - self.started)

    def finest(self, key):
        """Cell of the finest level, m."""
        return key.factor * self.cell / 2**self.own

    def settings(self, key):
        found = {"cell": float(f"{self.finest(key) * 2**key.levels:.12g}")}
        if self.most > 0:
            found["levels"] = key.levels
        if key.speed != 1.0:
            found["speed"] = key.speed
        if key.step != 1.0:
            found[self.time_step[0]] = key.step * self.time_step[1]
        if key.body != 1.0:
            found["body"] = key.body
        if key.section:
            found["section"] = True
        if key.fill:
            found["fill"] = key.fill
            if key.fill == "share" and "domain" not in self.case.get("time", [{}])[0]:
                found["domain"] = "corners"  # shares beside a surface want domains that end there
        return found

    def refuse(self, key):
        """A grid that cannot be run as the scene is, or settings that its grid alone does not explain."""
        self.refused.add(key.grid if key.is_plain else key)

    def run(self, key):
        """The run of settings, made if it is not there."""
        settings = self.settings(key)
        side = side_that_moves(self.case, settings["cell"])
        if side:
            self.refuse(key)
            raise Unusable(
                f"cells of {settings['cell']:.4g} m do not divide the grid, whose side {side} holds a body"
            )
        try:
            run = self.study.run(settings)
        except NoSection as fault:
            self.refuse(key)
            raise Unusable(str(fault)) from fault
        if not run.done:
            run.go()
        if not run.good:
            self.refuse(key)
            raise Unusable(f"{run.said or 'as the scene is'}: {run.record['fault']}")
        try:
            quantities.curve_of(run, self.quantity)
        except BadSetting as fault:
            self.refuse(key)
            raise Unusable(f"{run.said or 'as the scene is'}: {fault}") from fault
        self.done[key] = run
        return run

    def fit(self):
        """The model of the errors, from all runs."""
        curves = {key: quantities.curve_of(run, self.quantity) for key, run in self.done.items()}
        x = quantities.places(self.quantity, curves.values())
        samples = {
            key: Sample(
                self.finest(key), key.speed, key.step, quantities.at(self.quantity, curve, x), self.size(key)
            )
            for key, curve in curves.items()
        }
        slower, faster = (self.middle._replace(speed=speed) for speed in (0.5, 2.0))
        if self.other_surface in samples:
            worth = 1.0 if self.other_surface.fill == "share" else SHARES
            surfaces = samples[self.middle], samples[self.other_surface], worth
        else:
            surfaces = None
        others = {
            "speeds": next((key for key in (slower, faster) if key in samples), None),
            "faster": faster if faster in samples else None,
            "steps": self.middle._replace(step=0.5),
        }
        pairs = {
            what: (samples[self.middle], samples[other]) if other in samples else None
            for what, other in others.items()
        }
        if self.larger in samples:
            plain = self.larger._replace(body=1.0, speed=1.0)
            pairs["bodies"] = samples[plain], samples[self.larger]
        if self.quarter:
            pairs["sections"] = samples[self.quarter._replace(section=True)], samples[self.quarter]
        pilots = {key.factor for key in samples if self.is_pilot(key)}
        ladder = {}
        # one a cell, those like the scene first; with more levels a finer grid differs by more than its cell
        for key in sorted(samples, key=lambda key: (key.levels, not key.is_plain, key.speed, key.step)):
            if key.fill or key.section != self.flat:
                continue
            if key.levels <= self.own and (key.factor in pilots or key.factor < min(pilots)):
                ladder.setdefault(key.factor, samples[key])
        errors = Errors(list(ladder.values()), **pairs, half_space=self.options.half_space, surfaces=surfaces)
        self.measured = {key: errors.of(sample) for key, sample in samples.items()}
        return errors

    def is_pilot(self, key):
        """Of those that tell what the cell does."""
        return key.is_plain and key.levels <= self.own and key.section == self.flat

    def enlarged(self):
        """The pilot with a larger body: on the finest grid that was run so far where that takes a small part
        of the budget, else on the coarsest. As much slower, where it may be, so that waves cross it as
        often."""
        grids = sorted(one for one in self.done if one.is_plain)
        most = PILOT * self.options.budget * self.study.ranks / LARGER**4
        plain = next((one for one in grids if self.done[one].seconds <= most), grids[-1])
        return plain._replace(body=LARGER, speed=1 / LARGER if self.speeds else 1.0)

    def size(self, key):
        """Of the body of settings, over that of the scene: its sides move by whole cells."""
        if key.body == 1.0:
            return 1.0
        key = key._replace(section=False)  # its case has the whole body
        own, plain = (self.study.run(self.settings(one)) for one in (key, key._replace(body=1.0)))
        return size_of(own.case) / size_of(plain.case)

    def pilots(self):
        """From coarse to fine, three grids at least, and on while the target is not met in space and the next
        is cheap. Where the program does not take a grid with all levels of the scene, one of as fine cells
        with fewer. And a run each at another speed and time step on the last but one."""
        faults, last = [], None
        for factor in self.factors:
            begun = time.monotonic()
            if len(self.done) < 3 and self.left() <= 0:
                raise Missed(
                    f"the budget of {self.options.budget:g} s is spent, and {len(self.done)} cells of the "
                    "three that an order takes have been run"
                )
            if len(self.done) >= 3:
                errors = self.of_grids()
                total = errors.total(self.finest(min(self.done)))
                open_still = bool(errors.notes) or errors.trust > max(self.options.error, total)
                share = SEARCH if open_still else PILOT
                met = max(total, errors.trust) < ENOUGH * self.options.error
                next_one = last[1] * (last[0] / factor) ** (3 if self.flat else 4)
                spent = self.options.budget - self.left()
                if met or next_one > min(share * self.options.budget, PILOTS * self.options.budget - spent):
                    break
            for levels in range(self.own, -1, -1):
                try:
                    run = self.run(Key(factor, levels, section=self.flat))
                    last = factor, max(time.monotonic() - begun, run.seconds / self.study.ranks)
                    break
                except Unusable as fault:
                    faults.append(str(fault))
        if len(self.done) < 3:
            raise BadSetting(
                "fewer than three cells of "
                + ", ".join(f"{f:.3g}" for f in self.factors)
                + " times the scene's can be used: "
                + "; ".join(dict.fromkeys(faults))
            )
        self.middle = sorted(self.done)[1]
        try:
            if self.speeds:
                self.one_of(self.middle._replace(speed=speed) for speed in (2.0, 0.5))
                if self.flat:  # inertia grows faster than the speed: below it twice the speed shows too much
                    self.run(self.middle._replace(speed=0.5))
            self.run(self.middle._replace(step=0.5))
        except Unusable as fault:
            raise BadSetting(f"the part of the speed, or of the time step, is not to be had: {fault}")
        self.fill_otherwise()
        self.larger = self.enlarged()
        try:
            if self.size(self.larger) < LEAST_LARGER:
                raise BadSetting("body: it does not become larger by whole cells")
            self.run(self.larger)
        except (Unusable, BadSetting) as fault:
            self.no_larger = str(fault)
            if self.options.half_space:
                raise BadSetting(f"the part of the finite body is not to be had: {fault}")
        if self.flat:
            self.beside_section()

    def beside_section(self):
        """Pilots of the scene itself, for what its section does not tell, and for the price of a run: on the
        same grids, from the coarsest to the finest that takes a small part of the budget."""
        faults = []
        for key in sorted((key for key in self.done if self.is_pilot(key)), reverse=True):
            key = key._replace(section=False)
            if self.quarter:
                coarse = self.done[self.quarter].seconds
                seconds = coarse * (self.quarter.factor / key.factor) ** 4
                if seconds > PILOT * self.study.ranks * self.options.budget:
                    continue
            try:
                self.run(key)
                self.quarter = key
            except Unusable as fault:
                faults.append(str(fault))
        if not self.quarter:
            raise BadSetting("no grid of the scene itself can be used: " + "; ".join(dict.fromkeys(faults)))

    def fill_otherwise(self):
        """The pilot in which particles fill curved bodies in the other way: what the surface does to the
        answer, which the grids need not show, for all of them may have it."""
        bodies = [body for body in self.case["body"] if is_curved(self.case, body)]
        if not bodies:
            return
        written = self.done[self.middle].directory / "case.nml"
        used = read_namelists(written)["body"] if written.is_file() else self.case["body"]
        ways = {body.get("fill", ["whole"])[0].lower() for body in used if is_curved(self.case, body)}
        key = self.middle._replace(fill="share" if ways == {"whole"} else "whole")
        try:
            self.run(key)
            self.other_surface = key
        except Unusable as fault:
            say(f"surface    what another way to fill curved bodies changes is not known: {fault}")

    def one_of(self, keys):
        """The first of some settings that can be run."""
        for key in keys:
            try:
                return self.run(key)
            except Unusable as fault:
                last = fault
        raise last

    def sharpen(self, errors):
        """More pilots after a miss, where they fit into half of what is left of the budget: one at half the
        speed, where the speed is said to put in much (inertia grows faster than the speed, so that what twice
        the speed showed is too much below it), and the next finer grid, where the limit of the grids is too
        open. Whether there are more now."""
        enough, before = ENOUGH * self.options.error, len(self.done)
        slower = self.middle._replace(speed=0.5)
        if self.speeds and errors.parts(self.finest(self.middle))["speed"] > enough:
            self.one_more(slower, 2 * self.done[self.middle].seconds, "slower")
        finest = min(key for key in self.done if self.is_pilot(key))
        factor = max((one for one in self.factors if one < finest.factor), default=None)
        if factor and errors.trust > enough:
            seconds = self.done[finest].seconds * (finest.factor / factor) ** (3 if self.flat else 4)
            self.one_more(finest._replace(factor=factor), seconds, "finer")
        return len(self.done) > before

    def one_more(self, key, seconds, what):
        """A pilot after a miss, if it is new, taken by the program, and not too long (core-seconds)."""
        if key in self.done or {key, key.grid} & self.refused:
            return
        if seconds > SHARPER * self.study.ranks * self.left():
            return
        try:
            self.run(key)
            say(f"pilot      one more, {what}: {self.done[key].said}")
        except Unusable as fault:
            say(f"refused    {fault}")

    def of_grids(self):
        """The error in space, from the grids alone that were run so far."""
        curves = {key: quantities.curve_of(run, self.quantity) for key, run in self.done.items()}
        x = quantities.places(self.quantity, curves.values())
        return Errors(
            [
                Sample(self.finest(key), 1.0, 1.0, quantities.at(self.quantity, curve, x))
                for key, curve in curves.items()
            ]
        )

    def work(self, key):
        """Steps, particle-steps, MB of settings: of the run that was made, else scaled from the nearest of as
        many levels, or from a plan of the scene's first grid with so many."""
        if key in self.done:
            near = key
        else:
            alike = [one for one in self.done if one.is_like(key)]
            near = min(alike, key=lambda one: (one.factor, abs(math.log(one.speed * one.step))), default=None)
        if near:
            run = self.done[near]
            steps, updates, megabytes = run.record["steps"], updates_of(run), run.record["megabytes"]
        else:
            near, plan = self.plan_of(key.levels, key.body)
            if plan.fault:
                return None
            steps, updates, megabytes = plan.steps, plan.updates, plan.megabytes
        finer, longer = near.factor / key.factor, near.speed * near.step / (key.speed * key.step)
        return steps * finer * longer, updates * finer**4 * longer, megabytes * finer**3

    def plan_of(self, levels, body):
        """Of the scene's first grid, with so many levels; of a larger body on the first grid of the coarsest
        pilot, if the program takes that: the other may be large."""
        if (levels, body) not in self.planned:
            factors = [2.0 ** (self.own - levels)]
            if body != 1.0:
                coarsest = max(one for one in self.done if one.is_plain)
                factors.insert(0, coarsest.factor * 2.0 ** (coarsest.levels - levels))
            for factor in factors:
                key = Key(factor, levels, body=body)
                plan = Planned(self.study, self.settings(key))
                if not plan.fault:
                    break
            self.planned[levels, body] = key, plan
        return self.planned[levels, body]

    def own_runs(self):
        """Those of the scene itself."""
        return {key: run for key, run in self.done.items() if not key.section}

    def price(self):
        """Of settings without a run or a plan that is like them, by all runs."""
        rows = ((*self.work(key)[:2], run.seconds) for key, run in self.own_runs().items())
        return Price(sorted(rows, key=lambda row: row[1]))

    def costs(self, key, price):
        """Core-seconds and MB: of the run itself, of its own plan, or scaled by the work from the nearest
        plan of as many levels, for a particle-step costs more where levels are small; else by all runs. None
        where settings cannot be planned."""
        work = self.work(key)
        if key in self.done:
            return self.done[key].seconds, work[2]
        if work is None or key in self.confirmed:
            return self.confirmed.get(key)
        alike = [one for one in self.confirmed if one.is_like(key)]
        if not alike:
            return price.of(*work[:2]), work[2]
        near = min(alike, key=lambda one: (abs(math.log(one.factor / key.factor)), -one.speed))
        share = price.of(*work[:2]) / price.of(*self.work(near)[:2])
        seconds, megabytes = self.confirmed[near]
        return seconds * share, megabytes * (near.factor / key.factor) ** 3

    def choices(self, errors):
        """All settings with what is predicted of them, or was found."""
        price = self.price()
        found = []
        speeds = SPEEDS if self.speeds else [1.0]
        if self.middle._replace(speed=0.5) in self.done:  # then no part of much faster ones is known
            most = 2.0 if self.middle._replace(speed=2.0) in self.done else 1.0
            speeds = [speed for speed in SPEEDS if speed <= most]
        grids = {
            (factor, levels, False) for factor in self.factors for levels in range(self.own, self.most + 1)
        } | {key.grid for key in self.own_runs()}
        for factor, levels, _ in sorted(grids - self.refused, reverse=True):
            for others in itertools.product(speeds, STEPS, BODIES if errors.half_space else [1.0]):
                key = Key(factor, levels, *others)
                costs = None if key in self.refused else self.costs(key, price)
                if costs:
                    error = errors.total(self.finest(key), *others)
                    error = max(error, self.measured.get(key, 0.0))  # where errors cancel: their sizes
                    found.append(Choice(self.settings(key), key, error, *costs))
        return found

    def confirm(self, key):
        """Time and memory of settings by their own plan, the time corrected by what the longest pilot took
        over what its plan says; or that the program does not take them."""
        plan = Planned(self.study, self.settings(key))
        if plan.fault:
            self.refused.add(key.grid if key.body == 1.0 else key)
            return
        if self.correction is None:
            longest = max(self.own_runs(), key=lambda one: self.done[one].seconds)
            known = Planned(self.study, self.settings(longest))
            self.correction = self.done[longest].seconds / known.seconds
        self.confirmed[key] = self.correction * plan.seconds, plan.megabytes

    def yardstick(self, seconds):
        """The longest of the pilots that take a twentieth of a run of so many seconds at most, or the
        shortest of all."""
        runs = sorted(self.own_runs().values(), key=lambda run: run.seconds)
        return [run for run in runs if run.seconds <= YARDSTICK * seconds or run is runs[0]][-1]

    def timed(self, choice):
        """The run of a choice, and the machine's pace meanwhile: what the same pilot takes before and after
        it, over what it took when prices were made. None for both where the run was there before."""
        if self.study.run(choice.settings).done:
            return self.run(choice.key), None
        pilot = self.yardstick(choice.seconds)
        usual = pilot.seconds / self.study.ranks
        pilot.go()
        run = self.run(choice.key)
        pilot.go()
        return run, [seconds / usual for seconds in pilot.record["seconds"][-2:]]


def updates_of(run):
    """Particle-steps of a run, from its cost.dat."""
    return float(notes_of(run.directory / "cost.dat")["particle_steps"])


def time_step_of(case):
    """What the time step of a scene hangs on, and its value: its own time_step (s), else safety."""
    group = case.get("time", [{}])[0]
    if group.get("time_step", [0.0])[0] > 0:
        return "time_step", group["time_step"][0]
    return "safety", group.get("safety", [0.35])[0]


def seconds_of(text):
    """Seconds of a time: 600, 90s, 10min, 2h."""
    found = re.fullmatch(r"([\d.]+(?:e[-+]?\d+)?) *(s|min|h|)", text.strip())
    if not found:
        raise argparse.ArgumentTypeError(f"{text} is no time; write 600 (seconds), 90s, 10min or 2h")
    return float(found[1]) * {"": 1, "s": 1, "min": 60, "h": 3600}[found[2]]


def speed_is_free(case):
    """Whether the answer that is looked for is that of slow loading: what is prescribed moves, and nothing
    else knows the time."""
    prescribed = (
        any("speeds" in one for group in ("tool", "motion") for one in case.get(group, []))
        or "pressure" in case
    )
    moving = any(
        any(body.get(name, [0])) for body in case.get("body", []) for name in ("velocity", "angular_velocity")
    )
    models = {material.get("model", [""])[0] for material in case.get("material", [])}
    return (
        prescribed and not moving and models <= rate_free and "gravity" not in case and "damping" not in case
    )


def sentence_of(parts):
    total = sum(parts.values())
    return "; ".join(
        f"{name} {value:.2g} % ({100 * value / total:.0f} % of it)" if total else name
        for name, value in parts.items()
    )


def write_answer(solve, out, choice, record):
    folder = solve.study.directory
    write_text(folder / "answer.json", json.dumps(record, indent=1) + "\n")
    scene = Scene(scene_of(solve.study.text, {**solve.base, **choice.settings}, solve.study.setting).text)
    for which, _ in enumerate(scene.groups("output")):
        scene.set("output", "directory", f"{out}/run", which)
    write_text(folder / "chosen.nml", scene.text)


def record_of(solve, errors, choice, run, predicted, pace):
    others = choice.key.speed, choice.key.step, solve.size(choice.key)
    parts = errors.parts(solve.finest(choice.key), *others)
    error = solve.measured[choice.key]
    return {
        "scene": str(solve.study.scene),
        "quantity": solve.quantity.name,
        "target": solve.options.error,
        "error": error,
        "error_uncertainty": errors.uncertainty(solve.finest(choice.key), *others),
        "finite_body": errors.finite_body(),
        "surface": errors.surface(solve.finest(choice.key)),
        "section": section_of(solve, errors, choice.key),
        "parts": parts,
        "order": errors.order,
        "settings": choice.settings,
        "finest_cell": solve.finest(choice.key),
        "ranks": solve.study.ranks,
        "predicted_error": choice.error,
        "seconds": run.seconds / solve.study.ranks,
        "predicted_seconds": predicted,
        "pace": pace,
        "megabytes": run.record.get("megabytes"),
        "predicted_megabytes": choice.megabytes,
        "run": str(run.directory),
        "chosen": str(solve.study.directory / "chosen.nml"),
        "met": error <= solve.options.error,
    }


def section_of(solve, errors, key):
    """What the pilots by the section were worth: how far the scene's own grid is from it, on its cells and on
    those of a run (per cent), and what the two took there; None where there were none."""
    if not solve.quarter:
        return None
    flat = solve.done[solve.quarter._replace(section=True)]
    return {
        "pilots": sum(one.section for one in solve.done),
        "seconds": sum(run.seconds for one, run in solve.done.items() if one.section) / solve.study.ranks,
        "cell": solve.finest(solve.quarter),
        "difference": errors.section(solve.finest(solve.quarter)),
        "difference_of_run": errors.section(solve.finest(key)),
        "price": flat.seconds / solve.done[solve.quarter].seconds,
    }


def said_of_time(record):
    """What a run took, beside what was said, and how much that tells."""
    took = f"{record['seconds']:.3g} s"
    if record["pace"] is None:
        return took + ", run before"
    off = record["seconds"] / record["predicted_seconds"] - 1
    slow = sum(record["pace"]) / len(record["pace"])
    at_pace = (1 + off) / slow - 1
    before, after = record["pace"]
    return (
        f"{took}, {100 * off:+.0f} % of what was predicted ({100 * at_pace:+.0f} % at the pace of pilots: "
        f"one of them took {before:.2f} and {after:.2f} times as long before and after it)"
    )


def say(text):
    print(text, flush=True)


def introduce(solve, errors):
    study = solve.study
    grids = ", ".join(
        f"{solve.finest(key):.4g}"
        for key in sorted(solve.done, reverse=True)
        if key.is_plain and key.section == solve.flat
    )
    say(
        f"{study.setting.title}: {solve.quantity.name}, error asked for {solve.options.error:g} % (rms over "
        f"{100 * solve.quantity.window[0]:.0f} to {100 * solve.quantity.window[1]:.0f} % of the way, of the "
        "largest value)"
    )
    say(
        f"pilots     finest cells {grids} m; order {errors.order:.2f} in the cell; the limit is known to "
        f"{errors.trust:.2g} %"
    )
    for note in errors.notes:
        say(f"note       {note}")
    said_of_section(solve, errors)
    finest = min(solve.finest(key) for key in solve.done)
    say(f"parts      at the finest of them: {sentence_of(errors.parts(finest))}")
    said_of_body(solve, errors)
    if solve.other_surface:
        say(
            f"surface    curved: fill='{solve.other_surface.fill}' opens the answer by "
            f"{errors.surface(solve.finest(solve.other_surface)):.2g} % on cells of "
            f"{solve.finest(solve.other_surface):.4g} m, less on finer ones in proportion"
        )
    if not solve.speeds:
        say("speed      is part of the problem here: it stays as it is")


def said_of_section(solve, errors):
    """Whether pilots were given by their section, and how far that stands for the scene."""
    if not solve.quarter:
        say(f"section    pilots are runs of the scene itself: {solve.no_section}")
        return
    found = section_of(solve, errors, solve.quarter)
    say(
        f"section    pilots are given by the section, {100 * found['price']:.2g} % of the price; on cells of "
        f"{found['cell']:.4g} m the scene itself differs from it by {found['difference']:.2g} %, which "
        "counts in proportion to the cell"
    )


def said_of_body(solve, errors):
    """By how much a half-space would differ, where that is no part of the error."""
    finite = errors.finite_body()
    if finite is None:
        say(f"body       as the scene says; a half-space was not looked at: {solve.no_larger}")
    elif not errors.half_space:
        size = solve.size(solve.larger)
        say(
            f"body       as the scene says; a half-space would differ by {finite:.2g} % (from a body "
            f"{size:.3g} times as large), no part of the error; it is with HALF_SPACE=1"
        )


def pick(solve, errors, again):
    """The cheapest settings that are predicted to meet the target with a margin and that the program takes;
    where they do not fit into what is left of the budget, those that meet it with nothing to spare, or a run
    that is there already. `again`, after a miss: first of all such a run."""
    target = solve.options.error
    while True:
        choices = solve.choices(errors)
        left = solve.study.ranks * max(solve.left(), 0.0)
        known, _ = choose([one for one in choices if one.key in solve.done], target, 0.0, margin=1.0)
        if known and again:
            return known
        for margin in (MARGIN, 1.0):
            cheapest, best = choose(choices, target, left, margin)
            if cheapest and cheapest.seconds <= left:
                break
        else:
            if known:
                return known
            raise Missed(refusal(solve, cheapest, best, min(choice.error for choice in choices)))
        if cheapest.key in solve.confirmed or cheapest.key in solve.done:
            return cheapest
        solve.confirm(cheapest.key)


def solve_scene(study, options):
    solve = Solve(study, options)
    solve.pilots()
    errors = solve.fit()
    introduce(solve, errors)
    attempts = 0
    while attempts < ROUNDS:
        try:
            choice = pick(solve, errors, attempts > 0)
        except Missed:
            if not solve.sharpen(errors):
                raise
            errors = solve.fit()
            continue
        predicted = choice.seconds / study.ranks
        say(
            f"chosen     {choice.said}: error {choice.error:.2g} %, {predicted:.3g} s on {study.ranks} "
            "rank(s), "
            f"{choice.megabytes:.3g} MB predicted (aimed at {100 * MARGIN:.0f} % of what was asked for"
            f"{'' if choice.error <= MARGIN * options.error else '; this has less to spare'})"
        )
        try:
            run, pace = solve.timed(choice)
        except Unusable as fault:
            say(f"refused    {fault}")
            continue
        attempts += 1
        errors = solve.fit()
        record = record_of(solve, errors, choice, run, predicted, pace)
        write_answer(solve, options.out, choice, record)
        say(
            f"reached    error {record['error']:.2g} +- {record['error_uncertainty']:.2g} %: "
            f"{sentence_of(record['parts'])}; {said_of_time(record)}"
        )
        if record["met"]:
            open_still = record["error"] + record["error_uncertainty"] > options.error
            say(
                "the target is met"
                + (", though by less than the error is uncertain by" if open_still else "")
                + f": {study.directory / 'answer.json'}, {study.directory / 'chosen.nml'}"
            )
            return record
        if attempts == ROUNDS:
            break
        say("the target is missed: once more, with all runs so far")
        if solve.sharpen(errors):
            errors = solve.fit()
    raise Missed(
        f"the target of {options.error:g} % was not reached in {ROUNDS} rounds: {record['error']:.2g} +- "
        f"{record['error_uncertainty']:.2g} % was ({study.directory / 'answer.json'})"
    )


def refusal(solve, cheapest, best, least):
    """What the target would take, and what the budget buys."""
    said = f"an error of {solve.options.error:g} % "
    if cheapest is None:
        said += f"is not to be had with the cells and speeds that are tried (the best is {least:.2g} %)"
    else:
        said += (
            f"would take {cheapest.seconds / solve.study.ranks:.3g} s and {cheapest.megabytes:.3g} MB "
            f"({cheapest.said}); the budget has {max(solve.left(), 0):.3g} s left"
        )
    if best is not None:
        said += (
            f"; within it {best.error:.2g} % is to be had, in {best.seconds / solve.study.ranks:.3g} s "
            f"({best.said})"
        )
    return said


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
    parser.add_argument(
        "--quantity", default="", help="one of the study's file beside the scene; without it load or energy"
    )
    parser.add_argument("--error", type=float, required=True, help="asked for, per cent")
    parser.add_argument(
        "--budget", type=seconds_of, default=600.0, help="of the clock for all runs: 600 (seconds), 10min, 2h"
    )
    parser.add_argument(
        "--half-space", action="store_true", help="the finite body is a part of the error, and is chosen too"
    )
    parser.add_argument(
        "--no-section", action="store_true", help="pilots are runs of the scene itself in any case"
    )
    parser.add_argument("--ranks", type=int, default=1, help="of each run (1)")
    parser.add_argument(
        "--setting", type=Path, help="another file than NAME.toml or studies/NAME.toml beside the scene"
    )
    parser.add_argument("--out", type=Path, help="out/solve/NAME when not given")
    parser.add_argument(
        "--program",
        type=Path,
        default=Path(os.environ.get("GIMP3D") or "gimp3d"),
        help="the environment's GIMP3D, else ./gimp3d",
    )
    parser.add_argument(
        "--launch",
        default=os.environ.get("MPIRUN", "mpirun"),
        help="what starts runs; -n RANKS PROGRAM follows",
    )
    return parser.parse_args(words)


def find(options):
    """The answer as a dictionary; its files are written, its way is printed. Raises NoAnswer."""
    options.build = Path("build/opt")
    options.out = options.out or Path("out/solve") / options.scene.stem
    try:
        if not options.scene.is_file():
            raise Unreadable(f"{options.scene}: no such scene")
        if "quasi_static" in read_namelists(options.scene):
            raise BadSetting(
                f"{options.scene}: its steps are quasi-static, and what they cost is known from a run alone; "
                "make study compares runs of such a scene"
            )
        if not (options.error > 0 and math.isfinite(options.error)):
            raise BadSetting("ERROR must be above 0, in per cent")
        if not options.budget > 0 or options.ranks < 1:
            raise BadSetting("BUDGET must be above 0 seconds, RANKS at least 1")
        try:
            study = Study(options)
        except senseless as error:
            raise Unreadable(f"{options.scene}, or the file of its study: the scene {why(error)}")
        if study.setting.program:
            raise BadSetting(f"{options.scene} is a scene of another program, which has no mode='plan'")
        study.setting.lenient = True
        clear(study.directory, ("answer.json", "chosen.nml"))
        return solve_scene(study, options)
    except Missed as reason:
        raise NoAnswer(1, str(reason)) from None
    except (BadSetting, Rejected, Unreadable) as error:
        raise NoAnswer(2, str(error)) from None


def main():
    try:
        find(arguments())
    except NoAnswer as reason:
        print(f"solve: {reason}", file=sys.stderr)
        return reason.status
    return 0


if __name__ == "__main__":
    sys.exit(main())
