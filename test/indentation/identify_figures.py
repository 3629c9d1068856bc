"""40 made-up materials, run on other cells and at another speed than the runs that come with the package,
found again from curves with 1 % of white noise; two of them under a sphere too. usage: identify_figures.py
ROOT; with --make GIMP3D the materials are run anew and test/references/identification.json is written (20
minutes on one core)"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.stats import norm

from gimp3d.identification import fit, forward, measured, observed, page, surrogate, words
from gimp3d.identification.cache import Cache
from gimp3d.identification.laws import power_law
from gimp3d.identification.tips import Tip, read_tip

ROOT = Path(sys.argv[1])
REFERENCE = ROOT / "test/references/identification.json"
ANGLES, YOUNG, DEPTH = (70.3, 60.0), 7e10, 300e-9
BALL, BALL_DEPTH = read_tip("sphere:10um"), 1e-6


def make(program):
    """Run all materials, and write their features."""
    reference = json.loads(REFERENCE.read_text())
    cache = Cache("truth", shipped=None)
    for row in reference["rows"]:
        hard = surrogate.flow_ratio(row[0], (row[1],)) < reference["hard"]
        numerics = forward.Numerics(**reference["numerics of hard metals" if hard else "numerics"])
        cases = [forward.Case(Tip("cone", a), row[0], (row[1],), numerics=numerics) for a in ANGLES]
        cache.run(cases, program=program)
        found = [surrogate.features(case, cache[case]["kept"]) for case in cases]
        row[2:] = [round(float(value), 5) for one in found for value in one]
    globe, numerics = BALL.model(BALL_DEPTH)[0], forward.Numerics(**reference["ball_numerics"])
    for row in reference["ball"]:
        case = forward.Case(globe, row[0], (row[1],), numerics=numerics)
        cache.run([case], program=program)
        row[2:] = [round(float(value), 5) for value in surrogate.features(case, cache[case]["kept"])]
    head = [f'"{key}": {json.dumps(value)}' for key, value in reference.items() if key != "rows"]
    rows = ",\n".join(json.dumps(row) for row in reference["rows"])
    REFERENCE.write_text("{\n" + ",\n".join([*head, f'"rows": [\n{rows}\n]']) + "}\n")


def curve(features, seed):
    """Depth and load of a cone, with 1 % of noise."""
    h = np.linspace(0, DEPTH, 300)
    load = np.exp(features[0]) * h**2
    share = np.linspace(1, 0, 150)[1:]
    recovered = forward.full_recovery(np.exp(features[1]), features[2])
    h = np.concatenate([h, DEPTH * (1 - recovered * (1 - share ** features[2]))])
    load = np.concatenate([load, load[-1] * share])
    return h, load + 0.01 * load.max() * np.random.default_rng(seed).standard_normal(load.size)


def spheres(rows, model):
    """The two under a sphere alone: what does not hold."""
    wrong = 0
    for number, (ratio, exponent, *features) in enumerate(rows):
        features, yielding = np.array(features), YOUNG / ratio
        features[0] += np.log(power_law(YOUNG, yielding, exponent, forward.REPRESENTATIVE))
        features[1] += features[0] - np.log(YOUNG)
        h, load = page.model_curve(features, BALL_DEPTH, BALL.model(BALL_DEPTH)[1])
        at = np.linspace(0, len(h) - 1, 450)
        h, load = (np.interp(at, np.arange(len(column)), column) for column in (h, load))
        load += 0.01 * load.max() * np.random.default_rng(50 + number).standard_normal(load.size)
        seen = observed.from_curves(BALL, [measured.Curve("made", h, load)])
        answer = fit.Problem([seen], [model]).answer()
        truths = {"modulus": YOUNG / 0.91, "yield_stress": yielding, "exponent": exponent}
        held = [
            answer.intervals[name][0] <= value <= answer.intervals[name][2] for name, value in truths.items()
        ]
        print(
            f"sphere alone, E/Y {ratio:g}, n {exponent:g}: "
            + ", ".join(f"{name} {answer.intervals[name][1] / value:.3f}" for name, value in truths.items())
            + f" of the truth, in their intervals {held}; half-width of the yield stress "
            f"{words.half_width(answer.intervals['yield_stress']):.3f}, determined {words.determined(answer)}"
        )
        wrong += not all(held)
    return wrong


def sigmas(problem, p, strain=0.033):
    """One sigma of the logarithm of the stress at a plastic strain, at the truth p: by the noise of the data
    alone, which nothing can beat; with what the polynomials are off by; with what cells and speed change."""

    def stress(p):
        return np.log(problem.law.stress(*problem.material(np.asarray(p)), strain))

    rise = [(stress(p + step) - stress(p - step)) / 2e-4 for step in 1e-4 * np.eye(len(p))]
    data, own, cells, _ = problem.covariances(p)
    slope, found = problem.slope(p, np.eye(len(data))), []
    for covariance in (data, data + own, data + own + cells):
        known = slope.T @ np.linalg.inv(covariance + 1e-14 * np.eye(len(data))) @ slope
        found.append(np.sqrt(rise @ np.linalg.inv(known + np.diag(problem.wide**-2)) @ rise))
    return found


def main():
    built = surrogate.build(Cache("none"), [*(Tip("cone", a) for a in ANGLES), BALL.model(BALL_DEPTH)[0]])
    models = {tip.half_angle: one for tip, one in built.items() if tip.kind == "cone"}
    reference = json.loads(REFERENCE.read_text())
    rows = reference["rows"]
    table, best_possible = {1: [], 2: []}, []
    for number, (ratio, exponent, *features) in enumerate(rows):
        seen, yielding = [], YOUNG / ratio
        for k, angle in enumerate(ANGLES):
            f = features[3 * k : 3 * k + 3]
            ln_c = f[0] + np.log(power_law(YOUNG, yielding, exponent, forward.REPRESENTATIVE))
            made = measured.Curve(
                "made", *curve([ln_c, f[1] + ln_c - np.log(YOUNG), f[2]], 100 * number + int(angle))
            )
            seen.append(observed.from_curves(Tip("cone", angle), [made]))
        truth = np.array([np.log(YOUNG / (1 - forward.Case.poisson**2)), np.log(yielding), exponent])
        best_possible.append(sigmas(fit.Problem(seen, [models[a] for a in ANGLES]), truth))
        for tips in (1, 2):
            answer = fit.Problem(seen[:tips], [models[a] for a in ANGLES[:tips]]).answer()
            inside = answer.intervals
            truths = {
                "stress_best": power_law(YOUNG, yielding, exponent, answer.strain),
                "stress_0.033": power_law(YOUNG, yielding, exponent, 0.033),
                "modulus": YOUNG / 0.91,
                "yield_stress": yielding,
            }
            holds = [inside[name][0] <= value <= inside[name][2] for name, value in truths.items()]
            off = [abs(inside[name][1] / value - 1) for name, value in truths.items()]
            table[tips].append(
                [*off, *holds, words.half_width(inside["yield_stress"]), words.determined(answer)]
            )
    best_possible = np.array(best_possible)
    for name, column in zip(("the data's noise", "and polynomials", "and cells, speed"), best_possible.T):
        inside = np.sum(1 - 2 * norm.sf(0.03 / column))
        print(
            f"stress at 3.3 % by two tips, {name}: one sigma {100 * np.median(column):.2f} % in the median, "
            f"at most {100 * column.max():.2f} %; of 40 within 3 % are to be expected {inside:.1f}"
        )
    wrong = spheres(reference["ball"], built[BALL.model(BALL_DEPTH)[0]])
    for tips, found in table.items():
        found = np.array(found, float)
        best, rep, modulus = (found[:, k] for k in range(3))
        counts = {
            "stress at the strain known best within 3 %": np.sum(best < 0.03),
            "stress at 3.3 % within 3 %": np.sum(rep < 0.03),
            "E* within 6 %": np.sum(modulus < 0.06),
            "stress interval holds": found[:, 4].sum(),
            "modulus interval holds": found[:, 6].sum(),
            "yield interval holds": found[:, 7].sum(),
            "yield stress called determined": found[:, 9].sum(),
        }
        print(
            f"{tips} tip(s), of {len(found)}: "
            + "; ".join(f"{name} {int(value)}" for name, value in counts.items())
        )
        print(f"   median half-width of the yield stress {np.median(found[:, 8]):.3f}")
        wrong += min(counts["yield interval holds"], counts["stress interval holds"]) < 34
        if tips == 1:
            wrong += np.any(found[found[:, 9] > 0, 3] > 0.25)  # what is called determined is known that well
        else:
            wrong += (
                min(counts[f"stress at {where} within 3 %"] for where in ("the strain known best", "3.3 %"))
                < 38
            )
            wrong += np.median(found[:, 8]) > 0.12 or counts["yield interval holds"] == len(found)
    return int(wrong)


if __name__ == "__main__":
    if "--make" in sys.argv:
        sys.exit(make(sys.argv[sys.argv.index("--make") + 1]))
    sys.exit(main())
