"""What the data determine and what they do not, in sentences; and what experiment would help most."""

from dataclasses import dataclass

import numpy as np

from . import forward
from .fit import LEVEL, TABLE_POISSON
from .tips import Tip

KNOWN = 0.25  # half of an interval over its middle: above it a number is not determined
TOGETHER = 0.9  # correlation of two numbers that are known only together
DIRECTIONS = 0.25  # one sigma along a direction, as a share of stress: above it the data do not determine it
TITLES = {"modulus": "E*", "yield_stress": "yield stress", "exponent": "hardening exponent"}


@dataclass
class Direction:
    """A direction of (ln E*, ln yield stress, exponent times ln(1 + E eps/yield stress)): one sigma along it
    from the singular value of the whitened sensitivities."""

    weights: np.ndarray
    sigma: float


def half_width(interval):
    low, middle, high = interval
    return 0.5 * (high - low) / max(abs(middle), 1e-300)


def stretch(answer):
    """ln(1 + E eps / yield stress) at the representative strain: what the exponent does to the stress."""
    ratio = answer.best[0] * (1 - TABLE_POISSON**2) / answer.best[1]
    return float(np.log1p(ratio * forward.REPRESENTATIVE))


def directions(answer):
    scaled = answer.jacobian / np.array([1.0, 1.0, stretch(answer)])
    if scaled.shape[0] < 3:
        scaled = np.vstack([scaled, np.zeros((3 - scaled.shape[0], 3))])
    _, values, rows = np.linalg.svd(scaled)
    return [Direction(row, 1 / max(value, 1e-6)) for value, row in zip(values, rows)]


def correlation(answer, first=1, second=2):
    c = answer.covariance
    return float(c[first, second] / np.sqrt(c[first, first] * c[second, second]))


def percent(share):
    return f"{100 * share:.2g} %"


def describe(direction):
    """Such as `yield stress up by 10 %, exponent down`."""
    signs = ("E*", "yield stress", "exponent")
    parts = [
        f"{name} {'up' if weight > 0 else 'down'}"
        for name, weight in zip(
            signs, direction.weights * np.sign(direction.weights[np.argmax(np.abs(direction.weights))])
        )
        if abs(weight) > 0.25
    ]
    return " with ".join(parts)


def sentences(answer, tips):
    """What is determined, and what is not."""
    said = []
    inside = answer.intervals
    stress = half_width(inside["stress_best"])
    names = " and ".join(dict.fromkeys(tip.title for tip in tips))
    where = f"{100 * answer.strain:.2g} % plastic strain" if answer.strain > 0 else "the beginning of flow"
    said.append(
        f"The data ({names}) determine the stress at {where} within {percent(stress)} and E* within "
        f"{percent(half_width(inside['modulus']))} ({100 * LEVEL:.0f} % intervals)."
    )
    yielding = half_width(inside["yield_stress"])
    span = inside["exponent"][2] - inside["exponent"][0]
    unknown = [one for one in directions(answer) if one.sigma > DIRECTIONS]
    if determined(answer):
        said.append(
            f"The yield stress is determined within {percent(yielding)}, the exponent within {span / 2:.2g}."
        )
    else:
        said.append(
            f"The yield stress is not determined: its interval is {inside['yield_stress'][0] / 1e6:.4g} to "
            f"{inside['yield_stress'][2] / 1e6:.4g} MPa, that of the exponent {inside['exponent'][0]:.2g} to "
            f"{inside['exponent'][2]:.2g}."
        )
        if abs(correlation(answer)) > TOGETHER:
            said.append(
                "Yield stress and exponent are known only together: a higher yield stress with a lower "
                "exponent gives the same curve."
            )
    for one in unknown:
        said.append(
            f"Not determined is the direction {describe(one)} (one sigma along it: {percent(one.sigma)} of "
            f"stress; singular value {1 / one.sigma:.3g})."
        )
    if answer.freedom and answer.chi2 > answer.freedom + 4 * np.sqrt(2 * answer.freedom):
        said.append(
            f"The model does not fit: chi2 is {answer.chi2:.3g} at {answer.freedom} degrees of freedom. "
            "Another law, a worn tip, the frame's compliance or friction may be behind it; the intervals "
            "hold only where the model does."
        )
    return said


def determined(answer):
    """Whether yield stress and exponent are told apart: both the interval and the singular values say so."""
    return half_width(answer.intervals["yield_stress"]) <= KNOWN and all(
        one.sigma <= DIRECTIONS for one in directions(answer)
    )


CANDIDATES = (Tip("cone", 70.3), Tip("cone", 60.0), Tip("cone", 50.0), Tip("cone", 80.0))


@dataclass
class Suggestion:
    """A further experiment: half-widths of yield stress and exponent after it, and its price in runs."""

    tip: object
    before: float
    after: float
    exponent_after: float
    runs: int


def next_experiments(problem, answer, surrogate_of, noise=None, candidates=CANDIDATES):
    """Candidates by how much they shrink the interval of the yield stress, to first order about the optimum.
    surrogate_of(tip) gives a Surrogate, or None where the runs are missing: that candidate is left out.
    `noise`: covariance of the data of the new curve; without it that of the first one."""
    from .fit import Problem
    from .observed import Observed

    covariance = noise if noise is not None else np.diag([0.003, 0.006, 0.01]) ** 2
    found = []
    p = np.array([np.log(answer.best[0]), np.log(answer.best[1]), answer.best[2]])
    factor = 1.645
    before = factor * np.sqrt(answer.covariance[1, 1])
    for tip in candidates:
        model = surrogate_of(tip)
        if model is None:
            continue
        more = Observed(tip, ["ln C", "ln recovery", "1/m"], np.zeros(3), covariance, lambda f: f)
        wider = Problem([*problem.observed, more], [*problem.surrogates, model], problem.exponents)
        wider.values = wider.predict(p)
        total = sum(wider.covariances(p))
        slope = wider.slope(p, np.eye(len(total)))
        information = slope.T @ np.linalg.solve(total, slope) + np.diag([1 / 9.0, 1 / 9.0, 1 / 0.4**2])
        after = np.linalg.inv(information)
        found.append(Suggestion(tip, before, factor * np.sqrt(after[1, 1]), factor * np.sqrt(after[2, 2]), 0))
    return sorted(found, key=lambda one: one.after)


def advice(suggestions, left_out=(), minutes=0.0):
    """The best of them in a sentence, and those whose runs are missing, with the minutes that each takes."""
    said = []
    if suggestions:
        best = suggestions[0]
        change = f"from {percent(best.before)} to {percent(best.after)}"
        if best.after > 0.85 * best.before:
            said.append(
                f"No further cone of those with runs would help much: a {best.tip.title} takes the interval "
                f"of the yield stress {change} only."
            )
        else:
            said.append(
                f"What would help most: a {best.tip.title}. It takes the interval of the yield stress "
                f"{change} and that of the exponent to {best.exponent_after:.2g}, for one more indentation "
                "and no further runs."
            )
    if left_out:
        angles = ", ".join(f"{tip.half_angle:g}" for tip in left_out)
        said.append(
            f"Not looked at, for want of runs ({minutes:.1f} minutes each): cones of {angles} degrees."
        )
    return said
