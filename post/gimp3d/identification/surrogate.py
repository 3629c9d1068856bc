"""Polynomials through the runs of a tip, and how far they are off.

Features of a run, all of them smooth and near constant over the materials:
   ln C/sigma_r       loading curvature over the stress at the representative strain
   ln w E/C           work that comes back over load times depth, over what an elastic contact would give
   1/m                of the power of the unloading
and of a tip with a length, whose loading is no parabola, the power of the loading and how it changes.
The model's error has two parts. The scatter of the runs about the polynomials is each tip's own. What finer
cells in a wider body and slower tools change (pairs of runs; first order in the size of the cells and in the
speed) is corrected; SHARE_LEFT of the correction, and the scatter of the pairs, count as an uncertainty that
all tips share.

Laws of two coordinates (Ludwik, Voce) go by the polynomials of the power law that has their stress at both
ENDS, and by polynomials of what their own runs differ from it."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from scipy.stats import qmc

from . import forward
from .laws import KNOWN, POWER

NAMES = ("curvature", "recovery", "inverse exponent", "power of the loading", "its change")
SHARE_LEFT = 0.3  # of a correction: its uncertainty
UNKNOWN = {  # without pairs
    "cells": np.array([0.015, 0.03, 0.04, 0.02, 0.04]),
    "speed": np.array([0.01, 0.03, 0.05, 0.02, 0.04]),
}
RATIOS = (8.0, 1250.0)  # what the runs cover


def count_of(tip):
    """How many features a tip has."""
    return 5 if tip.has_length else 3


def features(case, kept):
    """Of a run."""
    bent = case.tip.has_length
    loading = forward.loading_law(kept, case) if bent else [np.log(forward.curvature(kept))]
    recovered, inverse = forward.unloading_law(kept, loading[0] if bent else None)
    back = np.log(forward.mean_recovery(recovered, inverse)) - loading[0]
    return np.array([loading[0] + np.log(case.flow_ratio), back, inverse, *loading[1:]])


def grid_reach(main, other):
    """By what the change between two sizes of cells is multiplied to cells of no size, first order; 0 where
    the other is not finer at the same speed."""
    if other.cells <= main.cells or other.speed != main.speed:
        return 0.0
    return (1 / main.cells) / (1 / main.cells - 1 / other.cells)


def speed_reach(main, other):
    """The same of the speed."""
    if other.speed >= main.speed or other.cells != main.cells:
        return 0.0
    return main.speed / (main.speed - other.speed)


def flow_ratio(ratio, shape, law=POWER):
    return ratio / law.stress(ratio, 1.0, shape, forward.REPRESENTATIVE)


def basis(ratio, shape, degree, law=POWER):
    """Products of powers up to a degree of the logarithm of E over the representative stress, and up to two
    of each coordinate of the law's shape."""
    ratio, shape = np.asarray(ratio, float), [np.asarray(one, float) for one in shape]
    if not law.flows:
        return np.ones((*ratio.shape, 1))
    x = (np.log(flow_ratio(ratio, shape, law)) - 4.0) / 2.5
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
    """One feature: degree, coefficients, scatter of the runs (one sigma), inverse of the normal matrix."""

    degree: int
    coefficients: np.ndarray
    scatter: float
    normal: np.ndarray


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
    """The degree with the least error where a run is left out; of an elastic law, which has none, the run."""
    if not law.flows:
        return Fitted(0, value[:1], 0.0, np.zeros((1, 1)))
    best = None
    for degree in (1, 2, 3, 4, 5) if law is POWER else (0, 1, 2):
        rows = basis(ratio, shape, degree, law)
        count, terms = rows.shape
        if count < terms + 4:
            break
        normal = np.linalg.inv(rows.T @ rows)
        coefficients = normal @ rows.T @ value
        left = (value - rows @ coefficients) / (1 - np.einsum("ij,jk,ik->i", rows, normal, rows))
        error = float(np.sqrt(np.mean(left**2)))
        if best is None or error < 0.97 * best[0]:
            residual = value - rows @ coefficients
            scatter = float(np.sqrt(residual @ residual / (count - terms)))
            best = error, Fitted(degree, coefficients, scatter, normal)
    return best[1]


class Surrogate:
    """Of one tip and law: `predict` at materials, `scatter` and `shared` (one sigma each feature)."""

    def __init__(self, tip, pairs, law=POWER, base=None, numerics=None):
        """pairs: (Case, record) of the tip and law, at any numerics; base: the Surrogate of the power law,
        where the law goes by it."""
        self.tip, self.numerics, self.law, self.base = tip, numerics or numerics_of(tip)[0], law, base
        self.count = count_of(tip)
        rows = [(case, features(case, record["kept"])) for case, record in pairs]
        main = [(case, found) for case, found in rows if case.numerics == self.numerics]
        self.cases = [case for case, _ in main]
        least = 14 if law.flows else 1
        if len(main) < least:
            raise TooFew(f"{tip.title}: {len(main)} runs, and the polynomials need {least}", design(tip, law))
        ratio = np.array([case.ratio for case in self.cases])
        shape = np.array([case.shape for case in self.cases]).T
        self.values = np.array([found for _, found in main])
        rest = self.values - self.of_base(ratio, shape) if base else self.values
        self.fits = [fit_feature(ratio, shape, rest[:, k], law) for k in range(self.count)]
        self.compare([(case, found) for case, found in rows if case.numerics != self.numerics])

    def compare(self, others):
        """What finer cells and slower tools change: for each of the two the changes of the features, and by
        what they are multiplied to cells and speeds of no size. Not corrected yet."""
        self.changes = {}
        for what, reach in REACHES.items():
            pairs = [(case, found) for case, found in others if reach(self.numerics, case.numerics) > 0]
            if pairs:
                reaches = [reach(self.numerics, case.numerics) for case, _ in pairs]
                self.changes[what] = np.array([self.change(*pair) for pair in pairs]), np.array(reaches)
        self.shift = np.zeros(self.count)
        self.shared = np.sqrt(sum(unknown[: self.count] ** 2 for unknown in UNKNOWN.values()))
        self.apart = np.zeros(self.count)

    def change(self, case, found):
        """Of a run beside the one of the same material with the others' cells and speed, or beside the
        polynomials where there is none."""
        for own, value in zip(self.cases, self.values):
            if (own.ratio, own.shape) == (case.ratio, case.shape):
                return found - value
        return found - self.plain(case.ratio, case.shape)

    def plain(self, ratio, shape):
        """Features on the cells of the runs; shape: a sequence of the law's coordinates."""
        rows = {degree: basis(ratio, shape, degree, self.law) for degree in {fit.degree for fit in self.fits}}
        found = np.stack([rows[fit.degree] @ fit.coefficients for fit in self.fits], axis=-1)
        return found + self.of_base(ratio, shape) if self.base else found

    def of_base(self, ratio, shape):
        """Features of the equivalent power law, over this law's stress at the representative strain."""
        over, exponent = equivalent(ratio, shape, self.law)
        found = self.base.plain(over, exponent)
        strain, yielding = forward.REPRESENTATIVE, np.asarray(ratio, float) / over
        stresses = POWER.stress(ratio, yielding, exponent, strain), self.law.stress(ratio, 1.0, shape, strain)
        found[..., 0] += np.log(stresses[0] / stresses[1])
        return found

    def predict(self, ratio, shape):
        """Features, on cells of no size."""
        return self.plain(ratio, shape) + self.shift

    def own(self, ratio, shape):
        """One sigma of each feature that is this tip's own: of the polynomials' coefficients, and of how far
        its pairs are from those of all tips, beyond their scatter. What the runs of a law scatter by about
        the equivalent power law, beyond the scatter of runs, is no noise: it counts as a whole."""
        found = []
        for k, fit in enumerate(self.fits):
            row = basis(ratio, shape, fit.degree, self.law)
            share = np.einsum("...i,ij,...j->...", row, fit.normal, row)
            form = max(fit.scatter**2 - self.base.fits[k].scatter ** 2, 0.0) if self.base else 0.0
            found.append(np.sqrt(fit.scatter**2 * share + form))
        spread = np.stack(found, axis=-1)
        if self.base:
            return np.hypot(spread, self.base.own(*equivalent(ratio, shape, self.law)))
        return np.hypot(spread, self.apart)


def correct(models):
    """Give all tips with as many features the correction of all their pairs: the mean, as far as it is beyond
    its own scatter; that of single runs is in the polynomials'."""
    if not models:
        return
    size = models[0].count
    shift, variance = np.zeros(size), np.zeros(size)
    apart = [np.zeros(size) for _ in models]
    for what, unknown in UNKNOWN.items():
        some = [model.changes[what] for model in models if what in model.changes]
        change = np.concatenate([np.zeros((0, size))] + [one[0] for one in some])
        if len(change) < 3:
            variance += unknown[:size] ** 2
            continue
        reach = np.concatenate([one[1] for one in some])[:, None]
        mean = (change * reach).mean(axis=0)
        error = (change * reach).std(axis=0, ddof=1) / np.sqrt(len(change))
        known = np.maximum(1 - (error / np.where(mean == 0, 1e-12, mean)) ** 2, 0.0)
        shift += known * mean
        variance += error**2 + (SHARE_LEFT * known * mean) ** 2
        for number, model in enumerate(models):
            if what in model.changes:
                own_changes = model.changes[what][0]
                noise = own_changes.var(axis=0, ddof=1) / len(own_changes) if len(own_changes) > 1 else 0.0
                differs = (own_changes.mean(axis=0) - change.mean(axis=0)) ** 2
                apart[number] += np.maximum(differs - noise, 0.0)
    for model, own in zip(models, apart):
        model.shift, model.shared, model.apart = shift, np.sqrt(variance), np.sqrt(own)


def build(cache, tips, law=POWER):
    """A Surrogate of a law for each of the tips, corrected by the pairs of all tips and laws in the cache
    that have as many features. Raises TooFew."""
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
        correct([model for model in every if model.count == count])
    for model in models.values():
        if model.base:
            model.shift, model.shared, model.apart = model.base.shift, model.base.shared, model.base.apart
    return powers if law is POWER else models


REACHES = {"cells": grid_reach, "speed": speed_reach}
SLOWER = {"speed": 0.35, "back": 0.002}
SHARP = forward.Numerics(), forward.Numerics(cells=3.0, fine=14, levels=5), forward.Numerics(**SLOWER)
BENT = (
    forward.Numerics(cells=2.6, fine=16),
    forward.Numerics(cells=3.9, fine=20, levels=5),
    forward.Numerics(cells=2.6, fine=16, **SLOWER),
)


def numerics_of(tip):
    """Of the runs of a tip, of those on finer cells, of those at a lower speed. The loading of a tip with a
    length is three numbers, and needs finer cells."""
    return BENT if tip.has_length else SHARP


EXPONENTS = (0, 0.12, 0.3, 0.55), (0, 0.2, 0.42)  # of sharp tips
CHECKED = ((22, 0.0), (60, 0.3), (165, 0.0), (450, 0.3))  # E/yield stress and exponents of the pairs


SPREAD = 24  # materials of a law of two coordinates


def materials(law, tip):
    """E over yield stress and shape of the runs of a law under a tip, and of those that are made on finer
    cells and at a lower speed too."""
    if not law.flows:
        return [(1.0, ())], [(1.0, ())]
    if law is POWER:
        exponents, between = ((0, 0.2, 0.5), (0.08, 0.35)) if tip.has_length else EXPONENTS
        found = [(r, (n,)) for n in exponents for r in (8, 22, 60, 165, 450, 1250)]
        found += [(r, (n,)) for n in between for r in (13, 35, 100, 270, 750)]
        return found, [(r, (n,)) for r, n in CHECKED]
    low, high = np.array([np.log(RATIOS[0]), *law.low]), np.array([np.log(RATIOS[1]), *law.high])
    rows = low + qmc.Sobol(len(low), seed=7).random(32)[:SPREAD] * (high - low)
    digits = lambda value: float(f"{value:.4g}")
    return [(digits(np.exp(row[0])), tuple(digits(value) for value in row[1:])) for row in rows], []


def design(tip, law=POWER):
    """The cases that a tip is run for, with those on finer cells and at a lower speed."""
    main, checked = materials(law, tip)
    before = design(tip) if law.flows and law is not POWER else []
    numerics, *others = numerics_of(tip)
    cases = before + [forward.Case(tip, r, shape, numerics=numerics, law=law.name) for r, shape in main]
    return cases + [
        forward.Case(tip, r, shape, numerics=numerics, law=law.name)
        for numerics in others
        for r, shape in checked
    ]
