"""Polynomials through the runs of a tip, and how far they are off.

Features of a run, all of them smooth and near constant over the materials:
   ln C/sigma_r       loading curvature over the stress at the representative strain
   ln w E/C           work that comes back over load times depth, over what an elastic contact would give
   1/m                of the power of the unloading
The model's error has two parts. The scatter of the runs about the polynomials is each tip's own. What finer
cells and slower tools change (pairs of runs; first order in the size of the cells and in the speed) is
corrected in C, and half of the correction counts as an uncertainty that all tips share; of the way back what
the pairs change on average, with its scatter, is the uncertainty."""

from dataclasses import dataclass

import numpy as np

from . import forward
from .laws import power_law

FEATURES = 3
NAMES = ("curvature", "recovery", "inverse exponent")
CORRECTED = np.array(
    [True, False, False]
)  # on the way back waves and damping matter, and not in one direction
SHARE_LEFT = 0.5  # of a correction: its uncertainty
UNKNOWN = {"cells": np.array([0.015, 0.03, 0.04]), "speed": np.array([0.01, 0.03, 0.05])}  # without pairs
RATIOS, EXPONENTS = (8.0, 1250.0), (0.0, 0.55)  # what the runs cover


def features(case, kept):
    """Of a run."""
    curvature = forward.curvature(kept)
    recovered, inverse = forward.unloading_law(kept)
    back = forward.mean_recovery(recovered, inverse)
    return np.array([np.log(curvature * case.flow_ratio), np.log(back / curvature), inverse])


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


def flow_ratio(ratio, exponent):
    return ratio / power_law(ratio, 1.0, exponent, forward.REPRESENTATIVE)


def basis(ratio, exponent, degree):
    """Products of powers up to a degree of the logarithm of E over the representative stress, and of the
    exponent."""
    x = (np.log(flow_ratio(np.asarray(ratio, float), np.asarray(exponent, float))) - 4.0) / 2.5
    y = (np.asarray(exponent, float) - 0.25) / 0.3
    return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i) if j < 3], axis=-1)


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


def fit_feature(ratio, exponent, value):
    """The degree with the least error where a run is left out."""
    best = None
    for degree in (1, 2, 3, 4, 5):
        rows = basis(ratio, exponent, degree)
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
    """Of one tip: `predict` at materials, `scatter` and `shared` (one sigma each feature)."""

    def __init__(self, tip, pairs, numerics=forward.Numerics()):
        """pairs: (Case, record) of the tip, at any numerics."""
        self.tip, self.numerics = tip, numerics
        rows = [(case, features(case, record["kept"])) for case, record in pairs]
        main = [(case, found) for case, found in rows if case.numerics == numerics]
        self.cases = [case for case, _ in main]
        if len(main) < 14:
            raise TooFew(f"{tip.title}: {len(main)} runs, and the polynomials need 14", design(tip))
        ratio = np.array([case.ratio for case in self.cases])
        exponent = np.array([case.exponent for case in self.cases])
        self.values = np.array([found for _, found in main])
        self.fits = [fit_feature(ratio, exponent, self.values[:, k]) for k in range(FEATURES)]
        self.compare([(case, found) for case, found in rows if case.numerics != numerics])

    def compare(self, others):
        """What finer cells and slower tools change: for each of the two the changes of the features, and by
        what they are multiplied to cells and speeds of no size. Not corrected yet."""
        self.changes = {}
        for what, reach in REACHES.items():
            pairs = [(case, found) for case, found in others if reach(self.numerics, case.numerics) > 0]
            if pairs:
                reaches = [reach(self.numerics, case.numerics) for case, _ in pairs]
                self.changes[what] = np.array([self.change(*pair) for pair in pairs]), np.array(reaches)
        self.shift = np.zeros(FEATURES)
        self.shared = np.sqrt(sum(unknown**2 for unknown in UNKNOWN.values()))
        self.apart = np.zeros(FEATURES)

    def change(self, case, found):
        """Of a run beside the one of the same material with the others' cells and speed, or beside the
        polynomials where there is none."""
        for own, value in zip(self.cases, self.values):
            if (own.ratio, own.exponent) == (case.ratio, case.exponent):
                return found - value
        return found - self.plain(case.ratio, case.exponent)

    def plain(self, ratio, exponent):
        """Features on the cells of the runs."""
        return np.stack([basis(ratio, exponent, fit.degree) @ fit.coefficients for fit in self.fits], axis=-1)

    def predict(self, ratio, exponent):
        """Features, on cells of no size."""
        return self.plain(ratio, exponent) + self.shift

    def own(self, ratio, exponent):
        """One sigma of each feature that is this tip's own: of the polynomials' coefficients, and of how far
        its pairs are from those of all tips, beyond their scatter."""
        found = []
        for fit in self.fits:
            row = basis(ratio, exponent, fit.degree)
            found.append(fit.scatter * np.sqrt(np.einsum("...i,ij,...j->...", row, fit.normal, row)))
        return np.hypot(np.stack(found, axis=-1), self.apart)


def correct(models):
    """Give all tips the correction of all their pairs: the mean, as far as it is beyond its own scatter. The
    way back is not corrected; its uncertainty is their mean, with its scatter: that of single runs is in the
    polynomials'."""
    shift, variance = np.zeros(FEATURES), np.zeros(FEATURES)
    apart = [np.zeros(FEATURES) for _ in models]
    for what, unknown in UNKNOWN.items():
        some = [model.changes[what] for model in models if what in model.changes]
        change = np.concatenate([np.zeros((0, FEATURES))] + [one[0] for one in some])
        if len(change) < 3:
            variance += unknown**2
            continue
        reach = np.concatenate([one[1] for one in some])[:, None]
        mean = (change * reach).mean(axis=0)
        error = (change * reach).std(axis=0, ddof=1) / np.sqrt(len(change))
        known = np.maximum(1 - (error / np.where(mean == 0, 1e-12, mean)) ** 2, 0.0)
        differ = np.mean(change, axis=0) ** 2 + change.var(axis=0, ddof=1) / len(change)
        shift += np.where(CORRECTED, known * mean, 0.0)
        variance += np.where(CORRECTED, error**2 + (SHARE_LEFT * known * mean) ** 2, differ)
        for number, model in enumerate(models):
            if what in model.changes:
                own_changes = model.changes[what][0]
                noise = own_changes.var(axis=0, ddof=1) / len(own_changes) if len(own_changes) > 1 else 0.0
                differs = (own_changes.mean(axis=0) - change.mean(axis=0)) ** 2
                apart[number] += np.maximum(differs - noise, 0.0)
    for model, own in zip(models, apart):
        model.shift, model.shared, model.apart = shift, np.sqrt(variance), np.sqrt(own)


def build(cache, tips):
    """A Surrogate for each of the tips, corrected by the pairs of all tips in the cache. Raises TooFew."""
    pairs = {}
    for case, record in cache.cases():
        pairs.setdefault(case.tip, []).append((case, record))
    models = {tip: Surrogate(tip, pairs.get(tip, [])) for tip in dict.fromkeys(tips)}
    for tip, found in pairs.items():
        try:
            models.setdefault(tip, Surrogate(tip, found))
        except TooFew:
            continue
    correct(list(models.values()))
    return models


REACHES = {"cells": grid_reach, "speed": speed_reach}
CELLS = forward.Numerics(cells=3.0, fine=14, levels=3)
SLOWER = forward.Numerics(speed=0.35, back=0.002)
BETWEEN = (13, 35, 100, 270, 750), (0, 0.2, 0.42)
CHECKED = ((22, 0.0), (60, 0.3), (165, 0.0), (450, 0.3))  # E/yield stress and exponents of the pairs


def design(tip, ratios=(8, 22, 60, 165, 450, 1250), exponents=(0, 0.12, 0.3, 0.55)):
    """The cases that a tip is run for, with those on finer cells and at a lower speed."""
    cases = [forward.Case(tip, r, n) for n in exponents for r in ratios]
    cases += [forward.Case(tip, r, n) for n in BETWEEN[1] for r in BETWEEN[0]]
    return cases + [
        forward.Case(tip, r, n, numerics=numerics) for numerics in (CELLS, SLOWER) for r, n in CHECKED
    ]
