"""From measured load-depth curves to the material, with intervals (doc/user/identification.md).

   gimp3d-post identify DATA=curve.csv TIP=berkovich
   gimp3d-post identify DATA=a.csv,b.csv TIP=cone:70.3 DATA=c.csv TIP=cone:60 FREE=compliance
   gimp3d-post identify SCENE=scene.nml DATA=measured.csv PARAMETERS=young=50e9:100e9 ...

 DATA       curves (.csv, .txt, .hld, directory of a run) or derived numbers (C, S, Wp/Wt, hf/hmax) of one tip
 TIP        tip of the preceding DATA: cone:ANGLE, berkovich, vickers, each with :rounding=LENGTH if it is
            rounded, sphere:RADIUS, area:FILE (an area function); lengths as 50nm, 5um
 LAW        power (default; also j2), ludwik, voce: E*, yield stress, hardening; elastic: E*
 PARAMETERS free parameters; the others of the law must be in FIX. Default: all
 FIX        known parameters: young=66.8e9:0.02 (relative uncertainty), yield_stress=..., ...
 FREE       zero, compliance, drift (requires times): fitted with the material
 NOISE      noise of the load that the fit begins with, per cent of the largest load
 POISSON    Poisson's ratio of the material (0.3); TIP_YOUNG (Pa; rigid), TIP_POISSON (0.07)
 CACHE      folder of the runs (out/identify/cache); SHIPPED=no: without the runs of the package
 INTERVALS  profile (default: profile likelihood) or emcee (Markov chains; requires the package emcee)
 CORES      number of concurrent runs; PLAN=only: forecast only; REFINE=no: no runs at the optimum
 WRITE      with TIPS=cone:70.3;cone:60: file for all runs of these tips, like cones.json of the package
 OUT        folder of answer.json and identification.html (out/identify)

With SCENE, a scene with placeholders @name@ is fitted to measured columns: identification.md, The general
form."""

import json
import os
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from .api import RunFailed
from .identification import fit, forward, observed, page, planning, surrogate, words
from .identification.cache import SHIPPED, Cache
from .identification.job import BadRequest, check_parameters, observe, priors_of, read_job
from .identification.tips import BadTip, length_of, read_tip
from .run_data import Unreadable


def pairs_of(cache, tip, law):
    return [(case, record) for case, record in cache.cases() if (case.tip, case.law) == (tip, law.name)]


NEAR = 0.11  # share of the range of a coordinate: nearer runs replace those at the optimum


def refinement(tips, answer, cache):
    """Cases at the medians, on the standard and on finer cells, for tips without a run nearby."""
    law = answer.law
    if not law.flows:
        return []
    middle = [quantiles[0] for quantiles in (
        fit.quantile(column, answer.weights, [0.5]) for column in answer.draws.T)]  # fmt: skip
    ratio = float(f"{np.exp(middle[0] - middle[1]) * (1 - fit.TABLE_POISSON**2):.3g}")
    shape = tuple(round(float(value), 2) for value in middle[2:])
    if not surrogate.RATIOS[0] <= ratio <= surrogate.RATIOS[1]:
        return []
    span = np.array(law.high) - np.array(law.low)
    found = []
    for tip in tips:
        near = [
            case
            for case, _ in pairs_of(cache, tip, law)
            if case.numerics == surrogate.numerics_of(tip)[1]
            and abs(np.log(case.ratio / ratio)) < 0.15
            and np.all(np.abs(np.array(case.shape) - shape) < NEAR * span)
        ]
        if not near:
            found += [
                forward.Case(tip, ratio, shape, numerics=numerics, law=law.name)
                for numerics in surrogate.numerics_of(tip)[:2]
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
        self.law, self.priors = job.law, priors_of(job)
        check_parameters(job, self.priors)
        self.observed = observe(job)
        self.tips = [one.tip.model(one.depth)[0] for one in self.observed]

    def missing(self):
        wanted = [case for tip in dict.fromkeys(self.tips) for case in surrogate.design(tip, self.law)]
        return [case for case in wanted if case not in self.cache]

    def plan(self):
        """Print and return the forecast for the missing runs and those at the optimum."""
        missing = self.missing()
        refined = 2 * len(set(self.tips)) if self.law.flows and self.job.settings.get("REFINE") != "no" else 0
        shape = tuple(np.add(self.law.low, self.law.high) / 2)
        again = [forward.Case(tip, 100.0, shape, numerics=numerics, law=self.law.name)
                 for tip in dict.fromkeys(self.tips)
                 for numerics in surrogate.numerics_of(tip)[:2]] if refined else []  # fmt: skip
        if not missing and not refined:
            print("Plan: no runs; all are in the cache.")
            return planning.Price()
        price = planning.price_of(missing + again, self.cores, self.program)
        print(
            f"Plan: {len(missing)} runs for {len(set(self.tips))} tip(s) that are not in the cache, "
            f"{refined} at the optimum: {price.words}, on {self.cores} core(s).",
            flush=True,
        )
        return price

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
        models = self.models = surrogate.build(self.cache, self.tips, self.law)
        chains = self.job.settings.get("INTERVALS") == "emcee"
        return fit.Problem(self.observed, [models[tip] for tip in self.tips], self.priors, chains)

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
        """Mean computing time (min) of the runs of one of the tips, scaled from the runs of the first tip."""
        if not tips:
            return 0.0
        known = [
            (planning.work(case), self.cache[case]["seconds"])
            for case, _ in pairs_of(self.cache, self.tips[0], self.law)
        ]
        pace = sum(seconds for _, seconds in known) / sum(work for work, _ in known)
        works = [planning.work(case) for tip in tips for case in surrogate.design(tip, self.law)]
        return sum(works) / len(tips) * pace / self.cores / 60

    def surrogate_of(self, tip):
        return self.models.get(tip)


def tip_to_run(word):
    """The tip that is run for a word of TIPS: `cone:60`, or with the depth of the experiment
    `sphere:10um@1um`."""
    text, _, depth = word.partition("@")
    tip = read_tip(text)
    if tip.has_length != bool(depth):
        raise BadRequest(
            f"TIPS={word}: a tip with a length scale needs @DEPTH, as sphere:10um@1um; a sharp tip has none"
        )
    try:
        return tip.model(length_of(depth) if depth else 1.0)[0]
    except ValueError:
        raise BadRequest(f"TIPS={word}: {depth} is not a length")


def fill(job):
    """All runs of TIPS, written to WRITE."""
    tips = [tip_to_run(word) for word in job.settings["TIPS"].split(";")]
    cache = Cache(
        job.settings.get("CACHE", "out/identify/cache"),
        SHIPPED if job.settings.get("SHIPPED") != "no" else None,
    )
    cores = int(job.number("CORES", len(os.sched_getaffinity(0))))
    shipped = "WRITE" in job.settings
    designs = [surrogate.shipped_design(tip) if shipped else surrogate.design(tip, job.law) for tip in tips]
    missing = [case for cases in designs for case in cases if case not in cache]
    price = planning.price_of(missing, cores, job.settings.get("PROGRAM"))
    print(f"Plan: {len(missing)} runs: {price.words}", flush=True)
    if job.settings.get("PLAN") == "only":
        return {"minutes": price.minutes}
    cache.run(missing, cores=cores, program=job.settings.get("PROGRAM"))
    if "WRITE" in job.settings:
        cache.write(job.settings["WRITE"], tips)
        print(job.settings["WRITE"])
    return {"runs": len(missing)}


def best_of(answer):
    """The optimum, SI units."""
    found = {"modulus_Pa": float(answer.best[0])}
    if answer.law.flows:
        found["yield_stress_Pa"] = float(answer.best[1])
        found |= dict(
            zip(answer.law.names, map(float, answer.law.constants(answer.best[1], answer.best[2:])))
        )
    return found


def answer_record(job, problem, answer, said, seconds):
    intervals = {
        name: dict(zip(("low", "median", "high"), found)) for name, found in answer.intervals.items()
    }
    return {
        "law": answer.law.name,
        "parameters": best_of(answer),
        "intervals_90": intervals,
        "covariance_ln_modulus_ln_yield_stress_coordinates": answer.covariance.tolist(),
        "chi2": answer.chi2,
        "degrees_of_freedom": answer.freedom,
        "strain_known_best": answer.strain,
        "determined": bool(words.determined(answer)),
        "sigma_from": {name: list(map(float, part)) for name, part in answer.parts.items()},
        "corrections": [one.corrections for one in problem.observed],
        "noise": [one.noise for one in problem.observed],
        "depth_noise_m": [one.depth_noise for one in problem.observed],
        "sentences": said,
        "seconds": round(seconds, 1),
        "command": "gimp3d-post identify " + " ".join(job.words),
    }


def show(job, answer, said):
    for name, value, interval in page.parameter_rows(answer, job.poisson, job.tip_compliance):
        print(f"  {name:<46} {value:>14}   {interval}")
    for sentence in said:
        print(sentence)


def advice(one, problem, answer):
    """Sentences on the next experiment; none for an elastic law."""
    if not answer.law.flows:
        return []
    left_out = [tip for tip in words.CANDIDATES if one.surrogate_of(tip) is None]
    return words.advice(
        words.next_experiments(problem, answer, one.surrogate_of), left_out, one.minutes_of_tip(left_out),
        words.COORDINATES[answer.law.name][0],
    )  # fmt: skip


def identify(arguments):
    """Run an identification; returns the record of answer.json. Raises BadRequest, Unreadable, RunFailed."""
    begun = time.monotonic()
    job = read_job(arguments)
    if "SCENE" in job.settings:
        from .identification import general

        return general.identify(job)
    if "TIPS" in job.settings:
        return fill(job)
    if job.settings.get("INTERVALS", "profile") not in ("profile", "emcee"):
        raise BadRequest(f"INTERVALS={job.settings['INTERVALS']}: allowed are profile, emcee")
    if job.settings.get("INTERVALS") == "emcee" and find_spec("emcee") is None:
        raise BadRequest("INTERVALS=emcee: the package emcee is not installed (pip install emcee)")
    one = Identification(job)
    price = one.plan()
    if job.settings.get("PLAN") == "only":
        return {"minutes": price.minutes, "predicted_processor_seconds": price.seconds}
    before = planning.spent()
    problem, answer = one.solve()
    unusual = [sentence for seen in one.observed for sentence in seen.unusual]
    said = words.sentences(answer, [seen.tip for seen in one.observed], unusual)
    said += advice(one, problem, answer)
    folder = Path(job.settings.get("OUT", "out/identify"))
    folder.mkdir(parents=True, exist_ok=True)
    record = answer_record(job, problem, answer, said, time.monotonic() - begun)
    record["predicted_minutes"], record["predicted_processor_seconds"] = price.minutes, price.seconds
    record["processor_seconds"] = planning.spent() - before
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
