"""Sentences on identifiability: what the data determine, what they do not, and the next experiment."""

from dataclasses import dataclass

import numpy as np

from . import forward
from .fit import LEVEL, TABLE_POISSON
from .tips import Tip

KNOWN = 0.25  # largest relative half-width of the interval of a parameter that is determined
CORRELATED = 0.9  # correlation coefficient above which two parameters are reported as correlated
DIRECTIONS = 0.25  # largest standard deviation (relative stress) of a direction that is determined
WHERE = (0.01, forward.REPRESENTATIVE, 0.1)  # plastic strains where the effect of a coordinate is evaluated


@dataclass
class Direction:
    """A direction in the space of ln E*, ln yield stress and each coordinate of the law times its derivative
    of ln stress; sigma: standard deviation along it, from the singular value of the whitened
    sensitivities."""

    weights: np.ndarray
    sigma: float


def half_width(interval):
    low, middle, high = interval
    return 0.5 * (high - low) / max(abs(middle), 1e-300)


def stretch(answer):
    """Derivative of ln stress with respect to each coordinate of the law; for the power law ln(1 + E eps /
    yield stress) at the representative strain."""
    law, found = answer.law, []
    young, yielding, shape = answer.best[0] * (1 - TABLE_POISSON**2), *answer.best[1:2], answer.best[2:]
    places = WHERE if len(shape) > 1 else (forward.REPRESENTATIVE,)
    for k, (low, high) in enumerate(zip(law.low, law.high)):
        ends = [np.array(shape) for _ in range(2)]
        step = 1e-3 * (high - low)
        ends[0][k], ends[1][k] = max(shape[k] - step, low), min(shape[k] + step, high)
        stresses = [np.log([law.stress(young, yielding, end, e) for e in places]) for end in ends]
        found.append(max(float(np.max(np.abs(stresses[1] - stresses[0])) / (ends[1][k] - ends[0][k])), 1e-3))
    return np.array(found)


def directions(answer):
    size = len(answer.covariance)
    scaled = answer.jacobian.copy()
    if answer.law.flows:
        scaled /= np.array([1.0, 1.0, *stretch(answer)])
    if scaled.shape[0] < size:
        scaled = np.vstack([scaled, np.zeros((size - scaled.shape[0], size))])
    _, values, rows = np.linalg.svd(scaled)
    return [Direction(row, 1 / max(value, 1e-6)) for value, row in zip(values, rows)]


def correlation(answer, first=1, second=2):
    c = answer.covariance
    return float(c[first, second] / np.sqrt(c[first, first] * c[second, second]))


def percent(share):
    value = 100 * share
    return f"{value:.0f} %" if value >= 99.5 else f"{value:.2g} %"


COORDINATES = {
    "power": ("exponent",),
    "ludwik": ("exponent", "hardening at 10 % strain over yield stress"),
    "voce": ("rise Q over yield stress", "rate b"),
    "elastic": (),
}


def describe(direction, law):
    """Such as `higher yield stress, lower exponent`."""
    signs = ("E*", "yield stress", *COORDINATES[law.name])
    parts = [
        f"{'higher' if weight > 0 else 'lower'} {name}"
        for name, weight in zip(
            signs, direction.weights * np.sign(direction.weights[np.argmax(np.abs(direction.weights))])
        )
        if abs(weight) > 0.25
    ]
    return ", ".join(parts)


def sentences(answer, tips, unusual=()):
    """The parameters that the data determine, and those that they do not; `unusual`: what the curves
    themselves do not fit."""
    return findings(answer, tips) + list(unusual) + misfit(answer)


def findings(answer, tips):
    said = []
    inside = answer.intervals
    names = " and ".join(dict.fromkeys(tip.title for tip in tips))
    if not answer.law.flows:
        said.append(
            f"The data ({names}) determine E* within {percent(half_width(inside['modulus']))} "
            f"({100 * LEVEL:.0f} % interval)."
        )
        return said
    stress = half_width(inside["stress_best"])
    where = f"{100 * answer.strain:.2g} % plastic strain" if answer.strain > 0 else "initial yield"
    said.append(
        f"The data ({names}) determine the stress at {where} within {percent(stress)} and E* within "
        f"{percent(half_width(inside['modulus']))} ({100 * LEVEL:.0f} % intervals)."
    )
    yielding = half_width(inside["yield_stress"])
    unknown = [one for one in directions(answer) if one.sigma > DIRECTIONS]
    hardening = list(zip(answer.law.names, answer.law.titles, answer.law.scales))
    if determined(answer):
        widths = [
            f"the {title} within {0.5 * scale * (inside[name][2] - inside[name][0]):.2g} {unit}".strip()
            for name, title, (scale, unit) in hardening
        ]
        said.append(f"The yield stress is determined within {percent(yielding)}, {', '.join(widths)}.")
    else:
        spans = [
            f"{title} {scale * inside[name][0]:.2g} to {scale * inside[name][2]:.2g} {unit}".strip()
            for name, title, (scale, unit) in hardening
        ]
        said.append(
            "The data do not determine the yield stress: the 90 % intervals are "
            f"{inside['yield_stress'][0] / 1e6:.4g} to {inside['yield_stress'][2] / 1e6:.4g} MPa, "
            f"{', '.join(spans)}."
        )
        if answer.law.name == "power" and abs(correlation(answer)) > CORRELATED:
            said.append(
                "Yield stress and exponent are strongly correlated: a higher yield stress with a lower "
                "exponent gives the same curve."
            )
    for one in unknown:
        said.append(
            f"Combination that is not determined: {describe(one, answer.law)} (standard deviation "
            f"{percent(one.sigma)} of the stress; singular value {1 / one.sigma:.3g})."
        )
    return said


def misfit(answer):
    """A sentence if the model does not fit the data."""
    if answer.freedom and answer.chi2 > answer.freedom + 4 * np.sqrt(2 * answer.freedom):
        return [
            f"The model does not fit the data: chi-squared is {answer.chi2:.3g} for {answer.freedom} "
            "degrees of freedom. Possible causes are another hardening law, a blunted tip, frame compliance "
            "or friction. The intervals are not valid."
        ]
    return []


def determined(answer):
    """Whether yield stress and exponent are determined, by the interval and by the singular values."""
    if not answer.law.flows:
        return half_width(answer.intervals["modulus"]) <= KNOWN
    return half_width(answer.intervals["yield_stress"]) <= KNOWN and all(
        one.sigma <= DIRECTIONS for one in directions(answer)
    )


CANDIDATES = (
    Tip("cone", 70.3), Tip("cone", 60.0), Tip("cone", 50.0), Tip("cone", 80.0),
    Tip("sphere", 0.0, 10.0).model(1.0)[0], Tip("sphere", 0.0, 3.0).model(1.0)[0],
)  # fmt: skip


@dataclass
class Suggestion:
    """An additional experiment: half-widths of yield stress and of the first coordinate with it."""

    tip: object
    before: float
    after: float
    exponent_after: float


def next_experiments(problem, answer, surrogate_of, noise=None, candidates=CANDIDATES):
    """Candidates sorted by the interval of the yield stress that they would leave, to first order about the
    optimum. surrogate_of(tip) gives a Surrogate, or None if the runs are missing: that candidate is left out.
    `noise`: standard deviations of the features of the new curve."""
    from .fit import Problem
    from .observed import Observed

    sigma = noise if noise is not None else np.array([0.003, 0.006, 0.01, 0.01, 0.02])
    found = []
    if not answer.law.flows:
        return found
    p = np.array([*np.log(answer.best[:2]), *answer.best[2:]])
    factor = 1.645
    before = factor * np.sqrt(answer.covariance[1, 1])
    for tip in candidates:
        model = surrogate_of(tip)
        if model is None:
            continue
        size = model.count
        more = Observed(tip, ["feature"] * size, np.zeros(size), np.diag(sigma[:size] ** 2), lambda f: f)
        wider = Problem([*problem.observed, more], [*problem.surrogates, model])
        wider.values = wider.predict(p)
        total = sum(wider.covariances(p))
        slope = wider.slope(p, np.eye(len(total)))
        known = np.diag(problem.wide**-2.0)
        for k, (_, width) in problem.priors.items():
            known[k, k] += 1 / width**2
        after = np.linalg.inv(slope.T @ np.linalg.solve(total, slope) + known)
        found.append(Suggestion(tip, before, factor * np.sqrt(after[1, 1]), factor * np.sqrt(after[2, 2])))
    return sorted(found, key=lambda one: one.after)


def candidate_title(tip):
    """Title of a tip as it is run: a sphere by its depth over its radius."""
    if tip.kind == "sphere":
        return f"sphere pressed in by {1 / tip.radius:.2g} of its radius"
    return tip.title


def advice(suggestions, left_out=(), minutes=0.0, coordinate="exponent"):
    """Sentences on the best candidates, and on those whose runs are missing, with the computing time (min) of
    each."""
    said = []
    if suggestions:
        best = suggestions[0]
        change = f"from {percent(best.before)} to {percent(best.after)}"
        if best.after > 0.85 * best.before:
            said.append(
                "No additional indentation with the available tips would help much: with a "
                f"{candidate_title(best.tip)} the half-width of the yield stress changes {change}."
            )
        else:
            said.append(
                f"Most useful additional experiment: one indentation with a {candidate_title(best.tip)}. It "
                f"reduces the half-width of the yield stress {change} and that of the {coordinate} to "
                f"{best.exponent_after:.2g}, without further runs."
            )
            others = [one for one in suggestions[1:] if one.after < 0.85 * one.before]
            if others:
                listed = ", ".join(f"{candidate_title(one.tip)} {percent(one.after)}" for one in others)
                said.append(f"Half-width of the yield stress with other tips: {listed}.")
    if left_out:
        listed = ", ".join(candidate_title(tip) for tip in left_out)
        said.append(
            f"Not evaluated, because their runs are missing (about {minutes:.1f} minutes each): {listed}."
        )
    return said
