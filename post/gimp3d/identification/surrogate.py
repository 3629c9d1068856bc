"""Polynomials through the runs of a tip, and how far they are off.

Features of a run, all of them smooth and near constant over the materials:
   ln C/sigma_r       loading curvature over the stress at the representative strain
   ln w E/C           work that comes back over load times depth, over what an elastic contact would give
   1/m                of the power of the unloading
and of a tip with a length, whose loading is no parabola, the power of the loading and how it changes.
The error of the model has two parts. The scatter of the runs about the polynomials is independent for each
tip. What cells, width of the body and speeds leave in the features is measured by pairs of runs that differ
in one of them alone, as a linear function of softness and exponent. Nothing is extrapolated: it is an
uncertainty (effects.py).

Laws of two coordinates (Ludwik, Voce) go by the polynomials of the power law that has their stress at both
ENDS, and by polynomials of what their own runs differ from it."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from scipy.stats import qmc

from . import forward
from .effects import KINDS, UNKNOWN, Effect, effect_between, reaches
from .laws import POWER

NAMES = ("curvature", "recovery", "inverse exponent", "power of the loading", "its change")
STEEPEST = 2.0  # change of the logarithm of the scatter of runs over the softness
ONE_RUN = 0.02  # one sigma of a law without flow, whose one run has the stiffness of its base and cells
SWEEPS = 4  # of the polynomials and of the scatter about them
FAR = 4.0  # sigmas
MANY = 12  # pairs of a tip that give its own effects of cells or speed
RATIOS = (8.0, 1250.0)  # what the runs cover


def count_of(tip):
    """How many features a tip has."""
    return 5 if tip.has_length else 3


def features(case, kept):
    """Of a run."""
    if case.tip.has_length:
        loading = forward.loading_law(kept, case)
        recovered, inverse = forward.unloading_law(kept, case)
    else:
        *loading, recovered, inverse = forward.sharp_law(kept, case)
    back = np.log(forward.mean_recovery(recovered, inverse)) - loading[0]
    return np.array([loading[0] + np.log(case.flow_ratio), back, inverse, *loading[1:]])


def flow_ratio(ratio, shape, law=POWER):
    return ratio / law.stress(ratio, 1.0, shape, forward.REPRESENTATIVE)


def softness(ratio, shape, law=POWER):
    """Logarithm of E over the representative stress, about -1 to 1; 0 for an elastic law."""
    ratio = np.asarray(ratio, float)
    return (np.log(flow_ratio(ratio, shape, law)) - 4.0) / 2.5 if law.flows else 0.0 * ratio


def place(ratio, shape, law=POWER):
    """Softness, and the exponent of the (equivalent) power law about 0.25, over 0.3 (..., 2)."""
    soft = softness(ratio, shape, law)
    if not law.flows:
        return np.stack([soft, soft], axis=-1)
    exponent = shape[0] if law is POWER else equivalent(ratio, shape, law)[1][0]
    return np.stack(np.broadcast_arrays(soft, (np.asarray(exponent, float) - 0.25) / 0.3), axis=-1)


def basis(ratio, shape, degree, law=POWER):
    """Products of powers up to a degree of the logarithm of E over the representative stress, and up to two
    of each coordinate of the law's shape."""
    ratio, shape = np.asarray(ratio, float), [np.asarray(one, float) for one in shape]
    if not law.flows:
        return np.ones((*ratio.shape, 1))
    x = softness(ratio, shape, law)
    if law is POWER:
        places = [(shape[0] - 0.25) / 0.3]
    else:
        places = [2 * (s - low) / (high - low) - 1 for s, low, high in zip(shape, law.low, law.high)]
    found = []
    for i in range(degree + 1):
        for powers in product(range(3), repeat=len(places)):
            if i + sum(powers) <= degree:
                found.append(x**i * math.prod(y**j for y, j in zip(places, powers)))
    return np.stack(np.broadcast_arrays(*found), axis=-1)


class TooFew(Exception):
    """The cache has not enough runs of a tip; `missing` are the cases."""

    def __init__(self, sentence, missing):
        super().__init__(sentence)
        self.missing = missing


@dataclass
class Fitted:
    """One feature: degree, coefficients; scatter of the runs (one sigma) at the softness 0, and the slope of
    its logarithm; inverse of the normal matrix."""

    degree: int
    coefficients: np.ndarray
    scatter: float
    slope: float
    normal: np.ndarray

    def scatter_at(self, place):
        return self.scatter * np.exp(self.slope * place)


ENDS = (0.01, 0.1)  # plastic strains where the equivalent power law has the same stress


def equivalent(ratio, shape, law):
    """E over yield stress and exponent of the power law that stands for another one."""
    ratio = np.asarray(ratio, float)
    stress = law.stress(ratio, 1.0, shape, ENDS[1])
    rise = np.log(law.stress(ratio, 1.0, shape, ENDS[1]) / law.stress(ratio, 1.0, shape, ENDS[0]))
    yielding, exponent = np.array(stress, float), np.zeros_like(ratio)
    for _ in range(25):  # of a power law the logarithm changes by less than the exponent
        yielding = stress * (1 + ratio * ENDS[1] / yielding) ** -exponent
        span = np.log1p(ratio * ENDS[1] / yielding) - np.log1p(ratio * ENDS[0] / yielding)
        exponent = np.clip(rise / span, POWER.low[0], POWER.high[0])
    return ratio / yielding, (exponent,)


def fit_feature(ratio, shape, value, law=POWER):
    """The degree with the least error where a run is left out; of an elastic law, which has none, the run.
    The recovery of soft metals is a small part of a cell, and scatters more: the logarithm of the scatter is a
    line in the softness, which also gives the runs their weights. Runs that are FAR sigmas off are left out."""
    if not law.flows:
        return Fitted(0, value[:1], ONE_RUN, 0.0, np.ones((1, 1)))
    place, slope, some = softness(ratio, shape, law), 0.0, np.ones(len(value), bool)
    shape = np.asarray(shape)
    for _ in range(SWEEPS):
        found = best_degree(ratio[some], shape[:, some], value[some], law, slope)
        left = np.abs(value - basis(ratio, shape, found.degree, law) @ found.coefficients)
        rows = np.stack([np.ones_like(place), place], axis=-1)
        line = np.linalg.lstsq(rows[some], np.log(left[some] + 1e-3 * found.scatter + 1e-300), rcond=None)[0]
        slope = float(np.clip(line[1], -STEEPEST, STEEPEST))
        if law is POWER:
            some = left < FAR * np.maximum(found.scatter_at(place), 1e-9)
    return found


def best_degree(ratio, shape, value, law, slope):
    """Fitted, of weights that go by exp(-2 slope softness)."""
    best, weight = None, np.exp(-slope * softness(ratio, shape, law))
    for degree in (1, 2, 3, 4, 5) if law is POWER else (0, 1, 2):
        plain = basis(ratio, shape, degree, law)
        rows = plain * weight[:, None]
        count, terms = rows.shape
        if count < terms + 4:
            break
        normal = np.linalg.inv(rows.T @ rows)
        coefficients = normal @ rows.T @ (weight * value)
        residual = weight * value - rows @ coefficients
        left = residual / (1 - np.einsum("ij,jk,ik->i", rows, normal, rows))
        error = float(np.sqrt(np.mean(left**2)))
        if best is None or error < 0.97 * best[0]:
            scatter = float(np.sqrt(residual @ residual / (count - terms)))
            best = error, Fitted(degree, coefficients, scatter, slope, normal)
    return best[1]


class Surrogate:
    """Of one tip and law: `predict` at materials, `scatter` and `shared` (one sigma each feature)."""

    def __init__(self, tip, pairs, law=POWER, base=None, numerics=None):
        """pairs: (Case, record) of the tip and law, at any numerics; base: the Surrogate of the power law,
        where the law goes by it."""
        self.tip, self.numerics, self.law, self.base = tip, numerics or numerics_of(tip)[0], law, base
        self.count = count_of(tip)
        groups = {}
        for case, record in pairs:
            groups.setdefault(case.numerics, []).append((case, record["kept"]))
        main = groups.pop(self.numerics, [])
        self.cases = [case for case, _ in main]
        least = 14 if law.flows else 1
        if len(main) < least:
            raise TooFew(f"{tip.title}: {len(main)} runs, and the polynomials need {least}", design(tip, law))
        ratio = np.array([case.ratio for case in self.cases])
        shape = np.array([case.shape for case in self.cases]).T
        self.values = np.array([features(*run) for run in main])
        rest = self.values - self.of_base(ratio, shape) if base else self.values
        self.fits = [fit_feature(ratio, shape, rest[:, k], law) for k in range(self.count)]
        self.compare(main, groups)

    def compare(self, main, groups):
        """What cell size and speed leave in the features, by pairs of runs that differ in one of them: for
        each pair the place of its material, the change as if of first order, its reach, the scatter of runs. A
        run without a partner is compared with the polynomials."""
        groups = {self.numerics: main, **groups}
        runs = {n: {(c.ratio, c.shape): features(c, kept) for c, kept in some} for n, some in groups.items()}
        self.changes = {}
        for other in list(groups)[1:]:
            partners = [self.numerics]
            if effect_between(self.numerics, other) is None:
                partners = [one for one in groups if effect_between(self.numerics, one) == "cells"]
            one = next((one for one in partners if effect_between(one, other)), None)
            if one is None:
                continue
            reach = reaches(self.numerics, one, other, self.count)
            for material, found in runs[other].items():
                beside = runs[one].get(material)
                if beside is None and one != self.numerics:
                    continue
                change = found - (self.predict(*material) if beside is None else beside)
                soft = softness(*material, self.law)
                noise = np.array([fit.scatter_at(soft) or 1.0 for fit in self.fits])
                row = place(*material, self.law), change * reach, reach, noise
                self.changes.setdefault(effect_between(one, other), []).append(row)
        self.effects = {what: Effect.unknown(sigma[: self.count]) for what, sigma in UNKNOWN.items()}
        self.apart = np.zeros(self.count)

    def predict(self, ratio, shape):
        """Features on the cells of the runs; shape: a sequence of the law's coordinates."""
        rows = {degree: basis(ratio, shape, degree, self.law) for degree in {fit.degree for fit in self.fits}}
        found = np.stack([rows[fit.degree] @ fit.coefficients for fit in self.fits], axis=-1)
        return found + self.of_base(ratio, shape) if self.base else found

    def of_base(self, ratio, shape):
        """Features of the equivalent power law, over this law's stress at the representative strain."""
        over, exponent = equivalent(ratio, shape, self.law)
        found = self.base.predict(over, exponent)
        strain, yielding = forward.REPRESENTATIVE, np.asarray(ratio, float) / over
        stresses = POWER.stress(ratio, yielding, exponent, strain), self.law.stress(ratio, 1.0, shape, strain)
        found[..., 0] += np.log(stresses[0] / stresses[1])
        return found

    def common(self, ratio, shape):
        """Deviations of the features (KINDS, 2, features), one sigma each, that all tips share: what is left
        of the effects, and the scatter of pairs of all tips."""
        where, found = place(ratio, shape, self.law), np.zeros((len(KINDS), 2, self.count))
        for kind, one in self.effects.items():
            found[KINDS.index(kind)] = one.deviation(where), np.sqrt(one.shared * one.variance(where))
        return found

    def shared(self, ratio, shape):
        """One sigma of each feature that all tips share."""
        return np.sqrt(np.sum(self.common(ratio, shape) ** 2, axis=(0, 1)))

    def own(self, ratio, shape):
        """One sigma of each feature that is this tip's own: of the polynomials' coefficients, of the scatter
        of its pairs, and of how far its pairs are from those of all tips. What the runs of a law scatter by
        about the equivalent power law, beyond the scatter of runs, is no noise: it counts as a whole."""
        found, soft = [], softness(ratio, shape, self.law)
        for k, fit in enumerate(self.fits):
            row, form = basis(ratio, shape, fit.degree, self.law), 0.0
            if self.base:
                form = fit.scatter_at(soft) ** 2 - self.base.fits[k].scatter_at(soft) ** 2
            share = np.einsum("...i,ij,...j->...", row, fit.normal, row)
            found.append(np.sqrt(fit.scatter**2 * share + np.maximum(form, 0.0)))
        spread = np.stack(found, axis=-1)
        if self.base:
            return np.hypot(spread, self.base.own(*equivalent(ratio, shape, self.law)))
        where = place(ratio, shape, self.law)
        pairs = sum((1 - one.shared) * one.variance(where) for one in self.effects.values())
        return np.sqrt(spread**2 + pairs + self.apart**2)


def share_effects(models):
    """Give tips with as many features the effects of cells and speed: those of their own pairs if they have
    MANY, else of the pairs of all tips. How far the pairs of a tip are from these, beyond their scatter, is
    then an uncertainty of its own."""
    for what in KINDS:
        every = [pair for model in models for pair in model.changes.get(what, [])]
        if len(every) < 3:
            continue
        common = Effect.measured(every)
        for model in models:
            pairs = model.changes.get(what, [])
            if what.endswith(" speed"):
                model.effects.pop("speed", None)
            if len(pairs) >= MANY:
                model.effects[what] = Effect.measured(pairs)
                model.effects[what].shared = 0.0
                continue
            model.effects[what] = common
            if len(pairs) >= 3:
                weight = np.array([1 / np.abs(reach * noise) for _, _, reach, noise in pairs]) ** 2
                left = np.array([change - common.first(where) for where, change, _, _ in pairs])
                mean = np.sum(weight * left, axis=0) / weight.sum(axis=0)
                spread = np.sum(weight * (left - mean) ** 2, axis=0) / weight.sum(axis=0)
                apart = np.maximum(mean**2 - spread / (len(pairs) - 1), 0.0)
                model.apart = np.sqrt(model.apart**2 + apart / 3)


def build(cache, tips, law=POWER):
    """A Surrogate of a law for each of the tips, with the effects that the pairs of all tips and laws in the
    cache with as many features show. Raises TooFew."""
    pairs = {}
    for case, record in cache.cases():
        pairs.setdefault((case.tip, case.law), []).append((case, record))
    powers, models = {}, {}
    for tip in dict.fromkeys([*tips, *(tip for tip, _ in pairs)]):
        try:
            if law.flows or (tip, POWER.name) in pairs:
                powers[tip] = Surrogate(tip, pairs.get((tip, POWER.name), []))
            if law is not POWER:
                base = powers.get(tip) if law.flows else None
                models[tip] = Surrogate(tip, pairs.get((tip, law.name), []), law, base)
        except TooFew:
            if tip in tips:
                raise
    every = list(powers.values()) + [model for model in models.values() if not model.base]
    for count in (3, 5):
        share_effects([model for model in every if model.count == count])
    for model in models.values():
        if model.base:
            model.effects, model.apart = model.base.effects, model.base.apart
    return powers if law is POWER else models


SHARP = (
    forward.Numerics(),
    forward.Numerics(cells=5.0, fine=18),
    forward.Numerics(cells=2.5, fine=12),
    forward.Numerics(cells=2.5, fine=12, levels=6),
    forward.Numerics(cells=2.5, fine=12, speed=0.35),
    forward.Numerics(cells=2.5, fine=12, back=0.0012),
)
OF_BENT = {"levels": 4, "back": 0.004, "fastest": 0.006}
BENT = (
    forward.Numerics(**OF_BENT | {"cells": 2.6, "fine": 16}),
    forward.Numerics(**OF_BENT | {"cells": 3.9, "fine": 20, "levels": 5}),
    forward.Numerics(**OF_BENT | {"cells": 2.6, "fine": 16, "speed": 0.35, "back": 0.002}),
)


def numerics_of(tip):
    """Of the runs of a tip; on finer cells; of the others that measure the effects of cells and speed. The
    loading of a tip with a length is three numbers."""
    return BENT if tip.has_length else SHARP


def checks_of(tip):
    """The Numerics of the runs beside the main ones. Under a sharp tip coarse cells are cheaper than fine
    ones, and the changes of speed are measured on coarse cells."""
    return BENT[1:] if tip.has_length else SHARP[2:]


EXPONENTS = (0, 0.12, 0.3, 0.55), (0, 0.2, 0.42)  # of sharp tips
CHECKED = (  # E/yield stress and exponents of the pairs: of sharp tips, of tips with a length
    ((13, 0.2), (22, 0.0), (35, 0.42), (60, 0.3), (165, 0.0), (450, 0.3)),
    ((22, 0.0), (60, 0.3), (165, 0.0), (450, 0.3)),
)


LEFT_OUT = (750, 0)  # under a cone of 60 degrees a particle below its point inverts
FINER = 4  # of these, under a sharp tip, that the package has on finer cells too
SPREAD = 24  # materials of a law of two coordinates


def materials(law, tip):
    """E over yield stress and shape of the runs of a law under a tip, and of those that are made on finer
    cells and at a lower speed too."""
    if not law.flows:
        return [(1.0, ())], [(1.0, ())]
    if law is POWER:
        exponents, between = ((0, 0.2, 0.5), (0.08, 0.35)) if tip.has_length else EXPONENTS
        found = [(r, (n,)) for n in exponents for r in (8, 22, 60, 165, 450, 1250)]
        found += [(r, (n,)) for n in between for r in (13, 35, 100, 270, 750) if (r, n) != LEFT_OUT]
        return found, [(r, (n,)) for r, n in CHECKED[tip.has_length]]
    low, high = np.array([np.log(RATIOS[0]), *law.low]), np.array([np.log(RATIOS[1]), *law.high])
    rows = low + qmc.Sobol(len(low), seed=7).random(32)[:SPREAD] * (high - low)
    digits = lambda value: float(f"{value:.4g}")
    return [(digits(np.exp(row[0])), tuple(digits(value) for value in row[1:])) for row in rows], []


def design(tip, law=POWER):
    """The cases that a tip is run for, with those on finer cells and at a lower speed."""
    main, checked = materials(law, tip)
    before = design(tip) if law.flows and law is not POWER else []
    places = [(numerics_of(tip)[0], main), *((numerics, checked) for numerics in checks_of(tip))]
    return before + [
        forward.Case(tip, r, shape, numerics=numerics, law=law.name)
        for numerics, some in places
        for r, shape in some
    ]


def shipped_design(tip):
    """The cases of a tip that come with the package: of a sharp one all on coarse cells too, and pairs on
    finer cells."""
    cases = design(tip)
    if not tip.has_length:
        main, checked = materials(POWER, tip)
        for numerics, some in ((SHARP[1], checked[:FINER]), (SHARP[2], main)):
            cases += [forward.Case(tip, r, shape, numerics=numerics) for r, shape in some]
    return list(dict.fromkeys(cases))
