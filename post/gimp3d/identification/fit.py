"""The fit: E*, yield stress and exponent of the power law from what the tips say, with the data's noise and
the model's error in one covariance.

   chi2 = (y - f(p))^T (D + M)^-1 (y - f(p))

D is the covariance of the data, M that of the model: the polynomials' own for each tip, and what finer cells
and slower tools might still change, which all tips share. The optimum is scipy.optimize.least_squares'. The
posterior, flat in ln E*, ln sigma_y and the exponent within what the runs cover, is sampled by importance
from a t distribution about the optimum. Intervals are those of the profile of the likelihood: what draws have
whose chi2 is at most 2.71 above the least (90 %), so that the edge of a parameter's range counts as any other
value. Values are medians of the posterior."""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi2_law
from scipy.stats import norm, qmc

from . import forward, surrogate
from .laws import power_law

TABLE_POISSON = 0.3
DRAWS = 2**14
LEVEL = 0.90
ABOVE = 2.706  # of chi2 over the least: the 90 % interval of one number
PYRAMID = np.array([0.035, 0.05, 0.05])  # of the features, where a cone stands for a pyramid: one sigma
STRAINS = np.concatenate([[0.0], np.geomspace(1e-3, 0.3, 60)])


@dataclass
class Answer:
    """best: E*, yield stress (Pa), exponent; draws of the same with their weights; `intervals` by name."""

    best: np.ndarray
    covariance: np.ndarray  # of ln E*, ln yield stress, exponent
    chi2: float
    freedom: int
    draws: np.ndarray  # of ln E*, ln yield stress, exponent
    weights: np.ndarray  # of the posterior
    inside: np.ndarray  # whether a draw's chi2 is at most ABOVE over the least
    jacobian: np.ndarray  # of the whitened values
    intervals: dict = field(default_factory=dict)
    strain: float = 0.0  # where the stress is known best
    band: list = field(default_factory=list)  # low, median, high of the stress at STRAINS
    parts: dict = field(default_factory=dict)  # of the variance of each parameter: data, polynomials, cells


class Problem:
    """Observed values of some tips, and the surrogate of each."""

    def __init__(self, observed, surrogates, exponents=(0.0, surrogate.EXPONENTS[1]), priors=None):
        """priors: number of a parameter: value of p (ln E*, ln yield stress, exponent) and its sigma."""
        self.observed, self.surrogates, self.exponents = observed, surrogates, exponents
        self.priors = priors or {}
        self.values = np.concatenate([one.values for one in observed])
        self.ends = np.cumsum([0] + [len(one.values) for one in observed])

    # ---- model ----

    def features(self, number, p):
        """ln C, ln of the mean recovery, 1/m of a tip; p: ln E*, ln yield stress, exponent (last axis)."""
        young = np.exp(p[..., 0]) * (1 - TABLE_POISSON**2)
        yielding, exponent = np.exp(p[..., 1]), p[..., 2]
        ratio = np.clip(young / yielding, 3.0, 5000.0)
        found = self.surrogates[number].predict(ratio, exponent)
        stress = power_law(young, yielding, exponent, forward.REPRESENTATIVE)
        ln_c = found[..., 0] + np.log(stress)
        return np.stack([ln_c, found[..., 1] + ln_c - np.log(young), found[..., 2]], axis=-1)

    def predict(self, p):
        p = np.asarray(p)
        parts = []
        for number, one in enumerate(self.observed):
            f = self.features(number, p)
            parts.append(np.moveaxis(np.asarray(one.of(np.moveaxis(f, -1, 0))), 0, -1))
        return np.concatenate(parts, axis=-1)

    def map_slope(self, number, p):
        """Of the observed values over the features."""
        one, f = self.observed[number], self.features(number, p)
        step = 1e-5
        columns = []
        for k in range(surrogate.FEATURES):
            ahead, behind = f.copy(), f.copy()
            ahead[k] += step
            behind[k] -= step
            columns.append((np.asarray(one.of(ahead)) - np.asarray(one.of(behind))) / (2 * step))
        return np.stack(columns, axis=-1)

    def covariances(self, p):
        """Of the data, of the polynomials, of the cells, of pyramids as cones."""
        size = len(self.values)
        data, own, cells, pyramid = (np.zeros((size, size)) for _ in range(4))
        ratio = np.exp(p[0]) * (1 - TABLE_POISSON**2) / np.exp(p[1])
        columns = np.zeros((size, surrogate.FEATURES))
        for number, one in enumerate(self.observed):
            rows = slice(self.ends[number], self.ends[number + 1])
            slope = self.map_slope(number, p)
            model = self.surrogates[number]
            data[rows, rows] = one.covariance
            own[rows, rows] = slope @ np.diag(model.own(ratio, p[2]) ** 2) @ slope.T
            if one.tip.pyramid:
                pyramid[rows, rows] = slope @ np.diag(PYRAMID**2) @ slope.T
            columns[rows] = slope * model.shared
        cells += columns @ columns.T
        return data, own, cells, pyramid

    # ---- optimum ----

    def start(self):
        """Materials to begin with: yield stress from C and E* from what comes back, at three exponents."""
        found = []
        one = self.observed[0]
        for exponent in (0.02, 0.2, 0.4):
            for ratio in (20.0, 80.0, 300.0):
                p = np.array([0.0, -np.log(ratio) - np.log(1 - TABLE_POISSON**2), exponent])
                p[:2] += one.values[0] - self.predict(p)[0]
                found.append(p)
        return found

    def solve(self):
        """The optimum: p, covariance, whitening, least_squares' own result."""
        middle = self.values.copy()
        size = 0.02
        best = None
        root = np.eye(len(middle)) * 1 / size
        for sweep in range(3):
            starts = self.start() if sweep == 0 else [best.x]
            for first in starts:
                found = least_squares(
                    lambda p: self.residual(p, root),
                    first,
                    bounds=(
                        [-np.inf, -np.inf, self.exponents[0] - 1e-9],
                        [np.inf, np.inf, self.exponents[1]],
                    ),
                    x_scale=[0.1, 0.1, 0.1],
                )
                if best is None or found.cost < best.cost or sweep > 0 and first is starts[0]:
                    best = found
            root = np.linalg.inv(
                np.linalg.cholesky(sum(self.covariances(best.x)) + 1e-12 * np.eye(len(middle)))
            )
        return best, root

    def outside(self, p):
        """How far E over yield stress is beyond what the runs cover, in 2 %."""
        ratio = p[0] + np.log(1 - TABLE_POISSON**2) - p[1]
        low, high = np.log(surrogate.RATIOS)
        return np.array([max(low - ratio, 0.0, ratio - high) / 0.02])

    def chi2(self, p, root):
        left = (self.predict(p) - self.values) @ root.T
        known = sum(((p[..., k] - value) / sigma) ** 2 for k, (value, sigma) in self.priors.items())
        return np.sum(left**2, axis=-1) + known

    def residual(self, p, root):
        """All that least squares make small."""
        known = [(p[k] - value) / sigma for k, (value, sigma) in self.priors.items()]
        return np.concatenate([root @ (self.predict(p) - self.values), known, self.outside(p)])

    # ---- answer ----

    def answer(self, seed=1):
        best, root = self.solve()
        jacobian = self.slope(best.x, root)
        information = jacobian.T @ jacobian + np.diag([1 / 3.0**2, 1 / 3.0**2, 1 / 0.4**2])
        for k, (_, sigma) in self.priors.items():
            information[k, k] += 1 / sigma**2
        covariance = np.linalg.inv(information)
        draws, weights, values = self.sample(best.x, covariance, root, seed)
        chi2 = float(self.chi2(best.x, root))
        least = float(values.min())  # the optimum may lie at, or beyond, the edge of what the runs cover
        inside = values <= (least if least > chi2 + 0.5 else min(chi2, least)) + ABOVE
        result = Answer(
            np.array([np.exp(best.x[0]), np.exp(best.x[1]), max(best.x[2], 0.0)]), covariance, chi2,
            max(len(self.values) - 3, 0), draws, weights, inside, jacobian,
        )  # fmt: skip
        self.intervals(result, best.x)
        return result

    def slope(self, p, root):
        columns = []
        for k, step in enumerate((1e-4, 1e-4, 1e-4)):
            ahead, behind = np.array(p), np.array(p)
            ahead[k] += step
            behind[k] = max(behind[k] - step, 0.0) if k == 2 else behind[k] - step
            columns.append(root @ (self.predict(ahead) - self.predict(behind)) / (ahead[k] - behind[k]))
        return np.stack(columns, axis=-1)

    def sample(self, centre, covariance, root, seed):
        """Draws (ln E*, ln yield stress, exponent) and weights that sum to 1."""
        low, high = np.log(surrogate.RATIOS)
        freedom = 5.0
        uniform = qmc.Sobol(4, seed=seed).random(DRAWS)
        normal = norm.ppf(np.clip(uniform[:, :3], 1e-9, 1 - 1e-9))
        stretch = np.sqrt(freedom / chi2_law.ppf(np.clip(uniform[:, 3], 1e-9, 1 - 1e-9), freedom))
        spread = 1.3**2 * covariance
        for _ in range(4):
            factor = np.linalg.cholesky(spread + 1e-14 * np.eye(3))
            z = normal * stretch[:, None]
            draws = centre + z @ factor.T
            log_q = -0.5 * (freedom + 3) * np.log1p(np.sum(z**2, axis=1) / freedom)
            ratio = draws[:, 0] + np.log(1 - TABLE_POISSON**2) - draws[:, 1]
            inside = (draws[:, 2] >= 0) & (draws[:, 2] <= self.exponents[1]) & (ratio > low) & (ratio < high)
            chi2 = np.full(len(draws), np.inf)
            chi2[inside] = self.chi2(draws[inside], root)
            log_p = -0.5 * chi2
            weight = np.exp(log_p - log_q - np.max(log_p - log_q))
            weight /= weight.sum()
            if 1 / np.sum(weight**2) > 0.2 * DRAWS:
                break
            centre = weight @ draws
            apart = draws - centre
            spread = 1.5 * (apart * weight[:, None]).T @ apart + 1e-8 * np.eye(3)
        kept = (weight > 1e-3 / DRAWS) | (chi2 <= chi2.min() + ABOVE)
        return draws[kept], weight[kept] / weight[kept].sum(), chi2[kept]

    def intervals(self, answer, optimum):
        draws = answer.draws
        young, yielding, exponent = np.exp(draws[:, 0]), np.exp(draws[:, 1]), draws[:, 2]
        at = lambda strain: power_law(young * (1 - TABLE_POISSON**2), yielding, exponent, strain)
        quantities = {
            "modulus": young,
            "yield_stress": yielding,
            "exponent": exponent,
            "stress_0.033": at(0.033),
        }
        curve = np.stack([at(strain) for strain in STRAINS], axis=0)
        spread = [weighted_std(np.log(row), answer.weights) for row in curve]
        answer.strain = float(STRAINS[int(np.argmin(spread))])
        quantities["stress_best"] = at(answer.strain)
        for name, values in quantities.items():
            answer.intervals[name] = self.interval(values, answer)
        answer.band = [self.interval(row, answer) for row in curve]
        whole = sum(self.covariances(optimum))
        inverse = np.linalg.inv(whole + 1e-12 * np.eye(len(whole)))
        slope = self.slope(optimum, np.eye(len(whole)))
        gain = answer.covariance @ slope.T @ inverse
        names = ("data", "polynomials", "cells", "pyramid")
        answer.parts = {
            name: np.sqrt(np.diag(gain @ part @ gain.T))
            for name, part in zip(names, self.covariances(optimum))
        }

    def interval(self, values, answer):
        """Low, median, high of a number of the draws."""
        low, high = float(values[answer.inside].min()), float(values[answer.inside].max())
        return low, float(np.clip(quantile(values, answer.weights, [0.5])[0], low, high)), high

    def profile(self, name, values, root, start):
        """chi2 at given values of a parameter (number of p), the others free."""
        others = [k for k in range(3) if k != name]
        found, x = [], np.array(start)
        for value in values:

            def residual(y, value=value):
                p = np.empty(3)
                p[name], p[others] = value, y
                return self.residual(p, root)

            low = np.array([-np.inf, -np.inf, 0.0])[others]
            high = np.array([np.inf, np.inf, self.exponents[1]])[others]
            first = np.clip(x[others], low + 1e-6, high - 1e-6)
            result = least_squares(residual, first, bounds=(low, high))
            x[others] = result.x
            found.append(2 * result.cost)
        return np.array(found)


def weighted_std(values, weights):
    mean = weights @ values
    return float(np.sqrt(weights @ (values - mean) ** 2))


def quantile(values, weights, shares):
    order = np.argsort(values)
    sums = np.cumsum(weights[order]) - 0.5 * weights[order]
    return [float(np.interp(share, sums, values[order])) for share in shares]
