"""From measured load-depth curves to the material, with intervals (doc/user/identification.md).

   gimp3d-post identify DATA=curve.csv TIP=berkovich
   gimp3d-post identify DATA=a.csv,b.csv TIP=cone:70.3 DATA=c.csv TIP=cone:60 FREE=compliance
   gimp3d-post identify SCENE=scene.nml DATA=measured.csv PARAMETERS=young=50e9:100e9 ...

 DATA       curves (.csv, .txt, .hld, a run's directory) or derived numbers (C, S, Wp/Wt, hf/hmax) of one tip
 TIP        of the DATA before it: cone:ANGLE, berkovich, vickers
 LAW        power (default): E*, yield stress, exponent
 FIX        what is known from elsewhere: young=66.8e9:0.02 (relative uncertainty), yield_stress=..., ...
 FREE       zero, compliance, drift: found with the material
 NOISE      of the load over its largest, per cent; without it that of the rows
 POISSON    of the material (0.3); TIP_YOUNG (Pa; rigid), TIP_POISSON (0.07)
 CACHE      folder of the runs (out/identify/cache); SHIPPED=no leaves out those that come with the package
 CORES      runs at once; PLAN=only says what would be run, and ends; REFINE=no makes no runs at the optimum
 WRITE      with TIPS=cone:70.3;cone:60: a file of all runs of these tips, as the shipped cones.json
 OUT        folder of answer.json and identification.html (out/identify)

With SCENE any scene with @name@ in it is fitted to measured columns: identification.md, The general form."""

import json
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .api import RunFailed
from .identification import fit, forward, measured, observed, page, planning, surrogate, words
from .identification.cache import SHIPPED, Cache
from .identification.tips import BadTip, Tip, read_tip
from .run_data import Unreadable

KEYS = {
    "DATA", "TIP", "LAW", "FIX", "FREE", "NOISE", "POISSON", "TIP_YOUNG", "TIP_POISSON", "CACHE", "SHIPPED",
    "CORES", "PLAN", "REFINE", "OUT", "SCENE", "PARAMETERS", "COLUMNS", "PROGRAM", "CHECK", "ROUNDS",
    "WRITE", "TIPS",
}  # fmt: skip


class BadRequest(Exception):
    """What was asked cannot be done; the text says why, and what is allowed."""


@dataclass
class Job:
    """What is asked: tips with their files, and the settings."""

    groups: list = field(default_factory=list)  # (Tip, [files])
    settings: dict = field(default_factory=dict)
    words: list = field(default_factory=list)
    notes: list = field(default_factory=list)

    @property
    def title(self):
        return "Material from " + ", ".join(Path(name).name for _, names in self.groups for name in names)

    @property
    def poisson(self):
        return self.number("POISSON", 0.3)

    @property
    def tip_compliance(self):
        """(1 - nu^2)/E of the tip, 1/Pa; 0: rigid."""
        young = self.number("TIP_YOUNG", 0.0)
        return (1 - self.number("TIP_POISSON", 0.07) ** 2) / young if young else 0.0

    def number(self, key, default):
        if key not in self.settings:
            return default
        try:
            return float(self.settings[key])
        except ValueError:
            raise BadRequest(f"{key}={self.settings[key]}: not a number")


def read_job(arguments):
    """A Job of KEY=VALUE words."""
    job, data = Job(words=list(arguments)), None
    for word in arguments:
        key, equals, value = word.partition("=")
        key = key.lstrip("-").upper().replace("-", "_")
        if not equals or key not in KEYS:
            raise BadRequest(f"{word}: not KEY=VALUE; the keys are {', '.join(sorted(KEYS))}")
        if key == "DATA":
            if data is not None:
                raise BadRequest(f"{word}: the DATA before it has no TIP")
            data = value.split(",")
        elif key == "TIP":
            if data is None:
                raise BadRequest(f"{word}: stands behind its DATA")
            job.groups.append((read_tip(value), data))
            data = None
        elif key in job.settings:
            raise BadRequest(f"{word}: {key} is given twice")
        else:
            job.settings[key] = value
    if data is not None and "SCENE" not in job.settings:
        raise BadRequest(f"DATA={','.join(data)}: needs a TIP behind it, as TIP=berkovich")
    if data is not None:
        job.settings["DATA"] = ",".join(data)
    if not job.groups and not {"SCENE", "TIPS"} & set(job.settings):
        raise BadRequest("nothing to fit: say DATA=curve.csv TIP=berkovich")
    return job


def observe(job):
    """An Observed for each tip."""
    free = [name for name in job.settings.get("FREE", "").split(",") if name]
    unknown = [name for name in free if name not in observed.FREE]
    if unknown:
        raise BadRequest(f"FREE={unknown[0]}: allowed are {', '.join(observed.FREE)}")
    noise = job.number("NOISE", 0.0) / 100 or None
    found = []
    for tip, names in job.groups:
        read = [measured.read_curve(name) for name in names]
        rows = [row for one in read if isinstance(one, list) for row in one]
        curves = [one for one in read if isinstance(one, measured.Curve)]
        if rows and curves:
            raise BadRequest(f"DATA={','.join(names)}: curves and derived numbers are two DATA")
        found.append(
            observed.from_curves(tip, curves, free, noise) if curves else observed.from_derived(tip, rows)
        )
    return found


def model_tip(tip, depth):
    """The tip that the forward model runs: its radius over the depth. Pyramids are cones."""
    half_angle = 70.3 if tip.pyramid and abs(tip.half_angle - 70.3) < 0.1 else tip.half_angle
    return Tip(tip.kind, half_angle, tip.radius).over(depth) if tip.has_length else Tip(tip.kind, half_angle)


def refuse_lengths(job):
    """Spheres and rounded tips: their loads are no power of the depth, so that three numbers do not hold
    them."""
    for tip, _ in job.groups:
        if tip.has_length:
            raise BadRequest(
                f"TIP: a {tip.title} has a length, its curve does not scale: take the general form (SCENE=)"
            )


def pairs_of(cache, tip):
    return [(case, record) for case, record in cache.cases() if case.tip == tip]


def priors_of(job):
    """FIX=name=value:uncertainty,... -> number of the parameter: value of p, sigma."""
    found = {}
    for word in filter(None, job.settings.get("FIX", "").split(",")):
        name, _, value = word.partition("=")
        number, _, share = value.partition(":")
        try:
            value, sigma = float(number), float(share or 0.01)
        except ValueError:
            raise BadRequest(f"FIX={word}: not NAME=VALUE or NAME=VALUE:UNCERTAINTY")
        if name == "young":
            star = 1 / ((1 - job.poisson**2) / value + job.tip_compliance)
            found[0] = float(np.log(star)), sigma
        elif name == "modulus":
            found[0] = float(np.log(value)), sigma
        elif name == "yield_stress":
            found[1] = float(np.log(value)), sigma
        elif name == "exponent":
            found[2] = value, sigma
        else:
            raise BadRequest(f"FIX={word}: allowed are young, modulus, yield_stress, exponent")
    return found


def refinement(tips, answer, cache):
    """Cases at the medians, on the cells of the others and on finer ones, where no run is near."""
    young, yielding, exponent = (
        answer.intervals[name][1] for name in ("modulus", "yield_stress", "exponent")
    )
    ratio = float(f"{young * (1 - fit.TABLE_POISSON**2) / yielding:.3g}")
    exponent = round(exponent, 2)
    if not surrogate.RATIOS[0] <= ratio <= surrogate.RATIOS[1]:
        return []
    found = []
    for tip in tips:
        near = [
            case
            for case, _ in pairs_of(cache, tip)
            if case.numerics == surrogate.CELLS
            and abs(np.log(case.ratio / ratio)) < 0.15
            and abs(case.exponent - exponent) < 0.06
        ]
        if not near:
            found += [
                forward.Case(tip, ratio, exponent, numerics=numerics)
                for numerics in (forward.Numerics(), surrogate.CELLS)
            ]
    return found


class Identification:
    """The steps: plan, runs, fit, refinement, page."""

    def __init__(self, job):
        self.job = job
        shipped = SHIPPED if job.settings.get("SHIPPED", "yes") != "no" else None
        self.cache = Cache(job.settings.get("CACHE", "out/identify/cache"), shipped)
        self.cores = int(job.number("CORES", len(os.sched_getaffinity(0))))
        self.program = job.settings.get("PROGRAM")
        refuse_lengths(job)
        self.observed, self.priors = observe(job), priors_of(job)
        self.tips = [model_tip(one.tip, one.depth) for one in self.observed]

    def missing(self):
        wanted = [case for tip in dict.fromkeys(self.tips) for case in surrogate.design(tip)]
        return [case for case in wanted if case not in self.cache]

    def plan(self):
        """Say what will be run: the runs that are missing, and those at the optimum."""
        missing = self.missing()
        refined = 0 if self.job.settings.get("REFINE") == "no" else 2 * len(set(self.tips))
        again = [forward.Case(tip, 100.0, 0.1, numerics=numerics) for tip in dict.fromkeys(self.tips)
                 for numerics in (forward.Numerics(), surrogate.CELLS)] if refined else []  # fmt: skip
        if not missing and not refined:
            print("Plan: no runs; all are in the cache.")
            return 0.0
        minutes = planning.minutes_of(missing + again, self.cores, self.program)
        print(
            f"Plan: {len(missing)} runs for {len(set(self.tips))} tip(s) that the cache lacks, {refined} at "
            f"the optimum: {minutes:.1f} minutes on {self.cores} core(s).",
            flush=True,
        )
        return minutes

    def run(self, cases):
        def progress(done, count):
            if sys.stderr.isatty():
                print(
                    f"\r{done} of {count} runs",
                    end="\n" if done == count else "",
                    file=sys.stderr,
                    flush=True,
                )

        self.cache.run(cases, cores=self.cores, program=self.program, progress=progress)

    def problem(self):
        models = self.models = surrogate.build(self.cache, self.tips)
        return fit.Problem(self.observed, [models[tip] for tip in self.tips], priors=self.priors)

    def solve(self):
        self.run(self.missing())
        problem = self.problem()
        answer = problem.answer()
        if self.job.settings.get("REFINE") != "no":
            more = refinement(dict.fromkeys(self.tips), answer, self.cache)
            if more:
                self.run(more)
                problem = self.problem()
                answer = problem.answer()
        return problem, answer

    def minutes_of_tip(self, tips):
        """What the runs of one of the tips would take, by what those of the first tip took."""
        if not tips:
            return 0.0
        known = [
            (planning.work(case), self.cache[case]["seconds"])
            for case, _ in pairs_of(self.cache, self.tips[0])
        ]
        pace = sum(seconds for _, seconds in known) / sum(work for work, _ in known)
        return sum(map(planning.work, surrogate.design(tips[0]))) * pace / self.cores / 60

    def surrogate_of(self, tip):
        return self.models.get(tip)


def fill(job):
    """All runs of TIPS, written to WRITE."""
    tips = [read_tip(word) for word in job.settings["TIPS"].split(";")]
    cache = Cache(
        job.settings.get("CACHE", "out/identify/cache"),
        SHIPPED if job.settings.get("SHIPPED") != "no" else None,
    )
    cores = int(job.number("CORES", len(os.sched_getaffinity(0))))
    missing = [case for tip in tips for case in surrogate.design(tip) if case not in cache]
    minutes = planning.minutes_of(missing, cores, job.settings.get("PROGRAM"))
    print(f"Plan: {len(missing)} runs: {minutes:.1f} minutes", flush=True)
    cache.run(missing, cores=cores, program=job.settings.get("PROGRAM"))
    if "WRITE" in job.settings:
        cache.write(job.settings["WRITE"], tips)
        print(job.settings["WRITE"])
    return {"runs": len(missing)}


def answer_record(job, problem, answer, said, seconds):
    intervals = {
        name: dict(zip(("low", "median", "high"), found)) for name, found in answer.intervals.items()
    }
    return {
        "parameters": dict(zip(("modulus_Pa", "yield_stress_Pa", "exponent"), map(float, answer.best))),
        "intervals_90": intervals,
        "covariance_ln_modulus_ln_yield_stress_exponent": answer.covariance.tolist(),
        "chi2": answer.chi2,
        "degrees_of_freedom": answer.freedom,
        "strain_known_best": answer.strain,
        "determined": bool(words.determined(answer)),
        "sigma_from": {name: list(map(float, part)) for name, part in answer.parts.items()},
        "corrections": [one.corrections for one in problem.observed],
        "noise": [one.noise for one in problem.observed],
        "sentences": said,
        "seconds": round(seconds, 1),
        "command": "gimp3d-post identify " + " ".join(job.words),
    }


def show(job, answer, said):
    for name, value, interval in page.parameter_rows(answer, job.poisson, job.tip_compliance):
        print(f"  {name:<46} {value:>14}   {interval}")
    for sentence in said:
        print(sentence)


def identify(arguments):
    """What the command does: the answer's record. Raises BadRequest, Unreadable, RunFailed."""
    begun = time.monotonic()
    job = read_job(arguments)
    if "SCENE" in job.settings:
        from .identification import general

        return general.identify(job)
    if "TIPS" in job.settings:
        return fill(job)
    if job.settings.get("LAW", "power") not in ("power", "j2"):
        raise BadRequest(
            f"LAW={job.settings['LAW']}: tips have power; other laws are the general form (SCENE=)"
        )
    one = Identification(job)
    minutes = one.plan()
    if job.settings.get("PLAN") == "only":
        return {"minutes": minutes}
    problem, answer = one.solve()
    said = words.sentences(answer, [o.tip for o in one.observed])
    left_out = [tip for tip in words.CANDIDATES if one.surrogate_of(tip) is None]
    said += words.advice(
        words.next_experiments(problem, answer, one.surrogate_of), left_out, one.minutes_of_tip(left_out)
    )
    folder = Path(job.settings.get("OUT", "out/identify"))
    folder.mkdir(parents=True, exist_ok=True)
    record = answer_record(job, problem, answer, said, time.monotonic() - begun)
    record["predicted_minutes"] = minutes
    (folder / "answer.json").write_text(json.dumps(record, indent=1) + "\n")
    page.write(folder / "identification.html", job, problem, answer, said, record["command"])
    show(job, answer, said)
    print(folder / "answer.json")
    print(folder / "identification.html")
    return record


def main():
    arguments = sys.argv[1:]
    if not arguments or arguments[0] in ("-h", "--help"):
        print("usage: gimp3d-post identify KEY=VALUE ...\n\n" + __doc__)
        return 0 if arguments else 2
    try:
        identify(arguments)
    except (BadRequest, BadTip, Unreadable, observed.NoUnloading, surrogate.TooFew) as error:
        print(f"identify: {error}", file=sys.stderr)
        return 2
    except RunFailed as failure:
        print(f"identify: a run failed: {failure}", file=sys.stderr)
        return failure.status if failure.status in (2, 3, 4, 5) else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
