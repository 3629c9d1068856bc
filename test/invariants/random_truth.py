#!/usr/bin/env python3
"""Small scenes made by chance: what a run with status 0 says must obey the laws of mechanics, and not depend
on how it is looked at.

usage: random_truth.py WORK PROGRAM COUNT [--mixtures, --sections] [--first SEED] [--only TWIN] [--show SEED] [--jobs N]
[--planted WHAT]

Of every scene (scenes.py makes it from its seed): energy never from nothing, little lost without a cause,
external work as booked and by the motion of the particles, mass, momentum of free bodies, the exact end of a
rod. And a second run of it, which must say the same: its mirror image, the whole of a quarter, or two ranks.
What a run itself warns of, with the size, is printed and is no failure within limits, but for energy from
nothing. With --mixtures the scenes are those of mixtures.py: contact groups with holes, implicit steps, levels
that the error places, crystals in grains, files; and the second run is the mirror image, one turned by a right
angle, two ranks, or one that was stopped and went on; with --sections those of sections.py, in plane strain or
of revolution, likewise. A scene that is refused (status 2) or ends with a numerical fault (status 3 and one sentence) is
counted and printed, and is no failure. Scenes that fail stand in WORK/failed; `--show SEED` prints one."""

import argparse
import collections
import concurrent.futures
import copy
import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from hard_case import surroundings
from random_scenes import faults_on_disk
from gimp3d.run_data import History, Unreadable
from mixtures import MIRROR, QUARTER_TURN, Mixture
from scenes import CELL, EDGE, Scene
from sections import Section

LIMIT = 60 * (5 if os.environ.get("BUILD") == "debug" else 1) * float(os.environ.get("SLOWER", 1))  # s

# Bars, as shares of the largest energy or work of the run unless something else is said
GAIN = 0.05  # energy from nothing
LOSS = 0.10  # energy lost without a cause that the scene has asked for
WORK = 0.05  # external work, of the largest external work where that is not small beside the energy
# of implicit scenes, with the work that particles get, which all terms of a step are booked for (theory.md,
# Quasi-static steps, Balance of energy)
BOOKS = 0.015
TRANSFER = 0.06  # lost between particles and nodes, where there is inertia
# between the work of tools and that of particles
TOUCH = 0.03
# the same where the summary warns of it; of energy from nothing only
SAID = {"work": 0.25, "loss": 0.5, "gain": 0.2}
# of mixtures, where a tip may hit a single particle, and implicit steps press what was not touched before
SAID_OF_MIXTURES = {"loss": 0.95}
SAID_OF_IMPLICIT = {"work": 0.5}
# 'usf', which has an error of first order in the time step, of either sign
MOMENTUM = 1e-9  # of free bodies, of the largest momentum of mass and energy
MASS = 1e-12  # relative
ROD = 0.02  # end of a rod, of its way; and 0.0005 of its length
SAME = 1e-6  # between twins, without contact
SAME_CONTACT = 1e-3  # with contact, which is solved to a tolerance
SAME_GROUPS = 1e-8  # between bodies
SAME_RUBBING = 1e-4  # between bodies, with friction or bonds
# metal under more than its hardening modulus: equilibrium is not unique, and round-off chooses a branch
SAME_BRANCH = 0.1
SAME_BITS = 1e-12  # of a run that was stopped and went on: the last digits of histories
LESS = 0.7  # a figure of an implicit scene, with half the step: then it is the step's
SAME_IMPLICIT = 1e-5  # implicit steps, to the tolerance of Newton's method
# whole and quarter with domain='corners' and a tool at the planes: there the faces are narrowed in the
# quarter and not in the whole (theory.md, eq. face-mean), and the two are not the same sum
SAME_FACES = 0.02
RATE_FORM = 0.4  # of the strain of a rod: 'elastic' has the energy of small strain (theory.md, Energy)

# For the test of this test: what is done to a history before it is looked at
PLANTED = {
    "gain": (
        "energy",
        "kinetic",
        lambda rows, x: x + 0.2 * np.abs(rows["external_work"]).max() * np.linspace(0, 1, len(x)),
    ),
    "loss": ("energy", "damped", lambda rows, x: x - 0.3 * np.abs(rows["external_work"]).max()),
    "work": ("energy", "particle_work", lambda rows, x: 0.9 * x),
    "books": ("energy", "particle_work", lambda rows, x: 0.97 * x),
    "mass": ("energy", "mass", lambda rows, x: x * (1 + 1e-11 * np.arange(len(x)))),
    "momentum": ("energy", "momentum_x", lambda rows, x: x + 1e-5 * rows["mass"] * np.arange(len(x))),
    "rod": ("probe_end", "z", lambda rows, x: x[0] + 1.05 * (x - x[0])),
    "twin": ("energy", "strain", lambda rows, x: x * (1 + 2e-3)),
}


class Run:
    """What a run of a scene left."""

    def __init__(self, program, scene, ranks, out, environment, restarted=False):
        shutil.rmtree(out, ignore_errors=True)
        command = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [program]
        files = Path(f"{out}_files")
        if isinstance(scene, Mixture):
            scene.write_files(files)
        text = scene.text("&checkpoint every_steps=4 /") if restarted else scene.text()
        self.take(command, text.replace("OUT", str(out)).replace("FOLDER", str(files)), out, environment)
        if restarted and self.status == 0 and not self.faults:
            # as if it had been killed after the last checkpoint but one
            saved = sorted(Path(out).glob("checkpoint_*.h5"))
            for path in saved[1:]:
                path.unlink()
            if len(saved) > 1:
                self.take([*command, "--restart", str(out)], "", out, environment)
        shutil.rmtree(files, ignore_errors=True)

    def take(self, command, text, out, environment):
        """One run of the program."""
        self.out, self.faults = out, []
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
        )
        try:
            output, errors = process.communicate(text.encode(), timeout=LIMIT)
        except subprocess.TimeoutExpired:
            process.terminate()
            process.communicate()
            self.status, self.sentence = None, ""
            self.faults = [f"it was still running after {LIMIT} s"]
            return
        self.status = process.returncode
        self.warned = [line for line in output.decode().splitlines() if line.startswith("WARNING: ")]
        sentences = [
            line[8:] for line in errors.decode(errors="replace").splitlines() if line.startswith("gimp3d: ")
        ]
        # said in the summary too
        self.out_of_range = [line for line in output.decode().splitlines() if line.startswith("range  ")][-1:]
        self.splits = b"domains: " in output and b"domains: 0 particles made" not in output
        self.sentence = sentences[-1] if sentences else ""
        if self.status not in (0, 2, 3) or (self.status != 0 and len(sentences) != 1):
            self.faults = [
                f"status {self.status}, {len(sentences)} sentences: {errors.decode(errors='replace')[-300:]}"
            ]
        self.faults += faults_on_disk(out, self.status)

    def history(self, name, planted=None):
        rows = History(self.out / f"{name}.dat")
        if planted and PLANTED[planted][0] == name:
            _, column, change = PLANTED[planted]
            rows.columns[column] = change(rows, rows[column])
        return rows


def invariants(scene, run, planted):
    """What is wrong with a run of status 0, as sentences with figures; and the figures."""
    rows = run.history("energy", planted)
    energy = rows["kinetic"] + rows["strain"] + rows["plastic"]
    work, damped = rows["external_work"], rows["damped"]
    implicit = getattr(scene, "implicit", False)
    largest = np.max([np.abs(work).max(), np.abs(damped).max(), energy.max()])
    if not largest > 0:
        return [], [], {}
    done = rows["particle_work"] if implicit and scene.tools else work
    excess = (energy - energy[0] - done + damped) / largest
    figures = {"gain": excess.max(), "loss": -excess.min()}
    scale = max(np.abs(work).max(), np.abs(rows["particle_work"]).max())
    figures["work"] = np.abs(work - rows["particle_work"]).max() / max(scale, 0.2 * largest)
    figures["mass"] = np.abs(rows["mass"] / rows["mass"][0] - 1).max()
    bars = {"gain": GAIN, "loss": LOSS, "work": WORK, "mass": MASS}
    if implicit:
        # particles that are split leave equilibrium, and what is let go is in no book
        booked = TRANSFER if run.splits else BOOKS
        bars |= {"gain": booked, "loss": booked if scene.static else TRANSFER, "work": TOUCH}
    # PIC; tools that bounce
    if (
        scene.family == "groups"
        or scene.flip < 1
        or scene.transfer == "plain"
        or any("loads" in tool for tool in scene.tools)
    ):
        del bars["loss"]
    if scene.family == "free" or getattr(scene, "free", False):
        momentum = np.stack([rows[f"momentum_{a}"] for a in "xyz"], axis=1)
        push = np.outer(rows["time"] - rows["time"][0], scene.gravity or [0, 0, 0]) * rows["mass"][0]
        figures["momentum"] = np.abs(momentum - momentum[0] - push).max() / np.sqrt(
            2 * rows["mass"][0] * largest
        )
        bars["momentum"] = MOMENTUM
    if scene.exact_end is not None:
        end = run.history("probe_end", planted)
        length = scene.bodies[0]["upper"][2]
        # the probe follows the lower half of a particle that is split, wherever that is in the rod;
        # the level reaches beyond the end
        half = 0.5 * EDGE[scene.per_cell] * CELL / (2 if scene.levels else 1)
        splits = (0, 1, 2) if run.splits else (0,)
        places = [end["z"][0] - half * (1 - 0.5**m) for m in splits]
        figures["rod"] = min(
            abs((end["z"][-1] - place) / (place / length * scene.exact_end) - 1) for place in places
        )
        bars["gain"] = GAIN + RATE_FORM * abs(scene.strain)
        if "loss" in bars:
            bars["loss"] = LOSS + RATE_FORM * abs(scene.strain)
        bars["rod"] = ROD + 5e-4 * length / abs(scene.exact_end)
    # the program says itself that ends and works may be off; not that energy comes from nothing
    if run.out_of_range:
        bars = {name: bar for name, bar in bars.items() if name not in ("rod", "work", "loss")}
    wrong, said = [], []
    for name, bar in bars.items():
        if figures[name] <= bar:
            continue
        text = f"{name} {figures[name]:.3g}, at most {bar:.3g}"
        limits = SAID | (SAID_OF_MIXTURES if isinstance(scene, Mixture) else {})
        limits |= SAID_OF_IMPLICIT if implicit else {}
        (said if is_said(name, scene, run) and figures[name] <= limits[name] else wrong).append(text)
    return wrong, said, figures


def is_said(name, scene, run):
    """True where the run itself warns of a figure."""
    words = {"work": "WARNING: work of", "loss": "WARNING: energy loss", "gain": "spurious energy growth"}
    if name not in words or (name == "gain" and scene.update != "usf"):
        return False
    return any(words[name] in line for line in run.warned)


def same(scene, kind):
    """How far apart two runs of a scene may be."""
    if isinstance(scene, Mixture):
        if kind == "restarted":
            return SAME_IMPLICIT if scene.implicit else SAME_BITS
        if scene.branches:
            return SAME_BRANCH
        if scene.family == "groups":
            return SAME_RUBBING if scene.rubs else SAME_GROUPS
        if scene.implicit and scene.rubs:
            return SAME_RUBBING
        return SAME_IMPLICIT if scene.implicit else SAME
    if not scene.tools:
        return SAME
    return SAME_FACES if kind == "whole" and scene.domain == "corners" else SAME_CONTACT


def apart(run, twin, factor=1, turn=np.eye(3), planted=None):
    """The same scene seen otherwise: the furthest that a sum at any time is from what it must be,
    relative."""
    one, other = run.history("energy"), twin.history("energy", planted if planted == "twin" else None)
    if one.rows != other.rows:
        return np.inf
    names = ["kinetic", "strain", "plastic", "damped", "external_work", "particle_work"]
    largest = max(np.finfo(float).tiny, *(np.abs(one[name]).max() for name in names[:5]))
    far = max(np.abs(factor * one[name] - other[name]).max() / (factor * largest) for name in names)
    if factor == 1:
        scale = np.sqrt(2 * one["mass"][0] * largest)
        momenta = [np.stack([rows[f"momentum_{a}"] for a in "xyz"], axis=1) for rows in (one, other)]
        far = max(far, np.abs(momenta[0] @ turn.T - momenta[1]).max() / scale)
    return far


def beyond_the_step(scene, wrong, figures, run_of):
    """Of what is wrong with an implicit scene, all but what half the step makes smaller in the books of energy:
    long steps of metal that flows have an error of first order, and small bars do not tell it from a term that
    is missing."""
    if not getattr(scene, "implicit", False) or not wrong:
        return wrong
    half = copy.deepcopy(scene)
    for kind, values in half.groups:
        if kind == "quasi_static":
            values |= {"step": 0.5 * values["step"], "max_step": 0.5 * values["max_step"]}
    run = run_of(half)
    if run.status != 0 or run.faults:
        return wrong
    less = invariants(half, run, None)[2]
    shutil.rmtree(run.out, ignore_errors=True)
    smaller = {name for name in ("gain", "loss", "work") if less.get(name, np.inf) <= LESS * figures[name]}
    return [text for text in wrong if text.split()[0] not in smaller]


def kinds_of(scene):
    """How else a scene can be looked at."""
    if isinstance(scene, Section):
        return scene.ways()
    if isinstance(scene, Mixture):
        return ["mirrored", "turned", "2 ranks", "restarted"]
    return ["mirrored", "2 ranks"] + (["whole", "whole"] if scene.quarter else [])


def try_seed(seed, program, work, environment, only, planted, make):
    """Run a scene and its twin: status, failures, figures, what else is to be said."""
    scene = make(seed)
    out = work / f"out_{seed}"
    run = Run(program, scene, 1, out, environment)
    wrong, figures, notes = list(run.faults), {}, []
    if run.sentence:
        notes.append(f"{run.status}: {run.sentence}")
    if run.status == 0 and not wrong:
        notes += run.warned + run.out_of_range
        wrong, said, figures = invariants(scene, run, planted)
        if not planted:
            wrong = beyond_the_step(
                scene, wrong, figures, lambda half: Run(program, half, 1, work / f"half_{seed}", environment)
            )
        notes += [f"says itself: {text}" for text in said]
        kinds = kinds_of(scene)
        kind = only or kinds[seed % len(kinds)]
        if kind not in kinds:
            kind = "mirrored"
        ways = {"mirrored": "mirrored", "turned": "turned", "whole": "whole"}
        twin = getattr(scene, ways[kind])() if kind in ways else scene
        ranks = 2 if kind == "2 ranks" else 1
        other = Run(program, twin, ranks, work / f"twin_{seed}", environment, kind == "restarted")
        if other.status != 0 or other.faults:
            wrong.append(f"{kind}: status {other.status}: {other.sentence} {other.faults}")
        else:
            turn = {"mirrored": MIRROR, "turned": getattr(scene, "quarter_turn", QUARTER_TURN)}.get(
                kind, np.eye(3)
            )
            far = figures[kind] = apart(run, other, 4 if kind == "whole" else 1, turn, planted)
            if not far <= same(scene, kind):
                wrong.append(f"{kind}: {far:.3g} apart, at most {same(scene, kind):.3g}")
        shutil.rmtree(other.out, ignore_errors=True)
    shutil.rmtree(out, ignore_errors=True)
    return seed, scene, run.status, wrong, figures, notes


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work", type=Path)
    parser.add_argument("program")
    parser.add_argument("count", type=int)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--only", choices=["mirrored", "turned", "whole", "2 ranks", "restarted"])
    parser.add_argument("--mixtures", action="store_true", help="scenes of all parts together")
    parser.add_argument("--sections", action="store_true", help="scenes given by a section")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--show", type=int)
    parser.add_argument("--planted", choices=PLANTED, help="change what a run says, so that it is wrong")
    parser.add_argument("--verbose", action="store_true")
    args = parser.parse_args()
    make = Section if args.sections else Mixture if args.mixtures else Scene
    if args.show is not None:
        print(make(args.show).text())
        return
    args.work.mkdir(parents=True, exist_ok=True)
    local = threading.local()

    def attempt(seed):
        if not hasattr(local, "environment"):
            local.environment = surroundings() | {"OMPI_MCA_mpi_yield_when_idle": "1"}
        try:
            return try_seed(
                seed,
                str(Path(args.program).resolve()),
                args.work.resolve(),
                local.environment,
                args.only,
                args.planted,
                make,
            )
        except Unreadable as error:
            return seed, make(seed), None, [str(error)], {}, []

    ends, wrong_ones, worst = collections.Counter(), [], {}
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for seed, scene, status, wrong, figures, notes in pool.map(
            attempt, range(args.first, args.first + args.count)
        ):
            ends[status] += 1
            for name, value in figures.items():
                worst[name] = max(worst.get(name, (0.0, 0)), (float(value), seed))
            for note in notes:
                print(f"   {seed} {scene.family}: {note[:230]}", flush=True)
            if args.verbose:
                print(
                    f"   {seed} {scene.family} {scene.law} {scene.domain} {scene.per_cell}: "
                    + ", ".join(f"{name} {value:.2g}" for name, value in figures.items()),
                    flush=True,
                )
            for what in wrong:
                print(
                    f"FAILED: seed {seed} ({scene.family}, {scene.law}, {scene.domain}, {scene.per_cell} per "
                    f"cell): {what}",
                    flush=True,
                )
            if wrong:
                wrong_ones.append(seed)
                (args.work / "failed").mkdir(exist_ok=True)
                (args.work / f"failed/seed_{seed}.nml").write_text(scene.text())
                if isinstance(scene, Mixture):
                    scene.write_files(args.work / f"failed/FOLDER_{seed}")
    print(
        "largest figures: "
        + ", ".join(f"{name} {value:.3g} (seed {seed})" for name, (value, seed) in sorted(worst.items()))
    )
    print(
        f"{args.count} scenes: ended with "
        + ", ".join(f"{number} x {status}" for status, number in sorted(ends.items(), key=str))
        + f"; {len(wrong_ones)} wrong"
        + (f": {wrong_ones}" if wrong_ones else "")
    )
    sys.exit(1 if wrong_ones else 0)


if __name__ == "__main__":
    main()
