"""The fit: E*, yield stress and hardening of a law from what the tips say, with the data's noise and the
model's error in one covariance.

   chi2 = (y - f(p))^T (D + M)^-1 (y - f(p))

D is the covariance of the data, M that of the model: the polynomials' own for each tip, and what finer cells
and slower tools might still change, which all tips share. The optimum is scipy.optimize.least_squares'. The
posterior, flat in ln E*, ln sigma_y and the law's coordinates within what the runs cover, is sampled by
importance from t distributions along the curved ridge of the likelihood, one for each of RIDGE values of
the first coordinate. Intervals are those of the profile of the likelihood: what draws, and optima along the
ridge, have whose chi2 is at most 2.71 above the least (90 %), so that the edge of a parameter's range counts
as any other value. Where the optimum is at such an edge, most of the posterior can be elsewhere: intervals
include its central 90 % too. Values are medians of the posterior. With emcee the draws are of its chains, and
the rule is the same: 90 % of a posterior, also those of highest density, leave out a true value at an edge
where the data hardly tell."""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2 as chi2_law
from scipy.stats import norm, qmc

from . import forward, surrogate
from .effects import KINDS

TABLE_POISSON = 0.3
DRAWS = 2**14
RIDGE = 12  # values of the first coordinate of a law
CHAIN = 1500  # steps of emcee's walkers
LEVEL = 0.90
ABOVE = 2.706  # of chi2 over the least: the 90 % interval of one number
PYRAMID = np.array(
    [0.025, 0.05, 0.05, 0.02, 0.02]
)  # of the features, where a cone stands for a pyramid: one sigma
STRAINS = np.concatenate([[0.0], np.geomspace(1e-3, 0.3, 60)])


@dataclass
class Answer:
    """best: E*, yield stress (Pa), the law's coordinates; draws of the same with their weights; `intervals`
    by name."""

    law: object
    best: np.ndarray
    covariance: np.ndarray  # of ln E*, ln yield stress, coordinates
    chi2: float
    freedom: int
    draws: np.ndarray  # of ln E*, ln yield stress, coordinates
    weights: np.ndarray  # of the posterior
    inside: np.ndarray  # whether a draw's chi2 is at most ABOVE over the least
    jacobian: np.ndarray  # of the whitened values
    intervals: dict = field(default_factory=dict)
    strain: float = 0.0  # where the stress is known best
    band: list = field(default_factory=list)  # low, median, high of the stress at STRAINS
    parts: dict = field(default_factory=dict)  # of the variance of each parameter: data, polynomials, cells


class Problem:
    """Observed values of some tips, and the surrogate of each, all of one law."""

    def __init__(self, observed, surrogates, priors=None, chains=False):
        """priors: number of a parameter: value of p (ln E*, ln yield stress, the law's coordinates) and its
        sigma; chains: draws are emcee's."""
        self.observed, self.surrogates, self.chains = observed, surrogates, chains
        self.law = surrogates[0].law
        self.priors = priors or {}
        free = [np.inf] * (2 if self.law.flows else 1)
        self.low = np.array([-value for value in free] + list(self.law.low))
        self.high = np.array(free + list(self.law.high))
        span = self.high[2:] - self.low[2:]
        self.wide = np.array([3.0] * len(free) + list(0.73 * span))  # one sigma of what is known before
        self.values = np.concatenate([one.values for one in observed])
        self.ends = np.cumsum([0] + [len(one.values) for one in observed])

    # ---- model ----

    def features(self, number, p):
        """ln C, ln of the mean recovery, 1/m of a tip, and of its loading where that is no parabola; p: ln
        E*, ln yield stress, coordinates of the law (last axis)."""
        young, yielding, shape = self.material(p)
        ratio = np.clip(young / yielding, 3.0, 5000.0) if self.law.flows else np.ones_like(young)
        found = np.array(self.surrogates[number].predict(ratio, shape))
        found[..., 0] += np.log(self.law.stress(young, yielding, shape, forward.REPRESENTATIVE))
        found[..., 1] += found[..., 0] - np.log(young)
        return found

    def material(self, p):
        """E (Pa; of a rigid tip), yield stress (Pa), coordinates of the law."""
        young = np.exp(p[..., 0]) * (1 - TABLE_POISSON**2)
        if not self.law.flows:
            return young, young, ()
        return young, np.exp(p[..., 1]), tuple(p[..., k] for k in range(2, p.shape[-1]))

    def ratio(self, p):
        """E over yield stress."""
        young, yielding, _ = self.material(np.asarray(p))
        return young / yielding

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
        for k in range(len(f)):
            ahead, behind = f.copy(), f.copy()
            ahead[k] += step
            behind[k] -= step
            columns.append((np.asarray(one.of(ahead)) - np.asarray(one.of(behind))) / (2 * step))
        return np.stack(columns, axis=-1)

    def covariances(self, p):
        """Of the data, of the polynomials, of the cells, of pyramids as cones."""
        size = len(self.values)
        data, own, cells, pyramid = (np.zeros((size, size)) for _ in range(4))
        ratio, shape = self.ratio(p), self.material(np.asarray(p))[2]
        columns = np.zeros((size, 2 * len(KINDS), 5))
        for number, one in enumerate(self.observed):
            rows = slice(self.ends[number], self.ends[number + 1])
            slope = self.map_slope(number, p)
            model = self.surrogates[number]
            data[rows, rows] = one.covariance
            own[rows, rows] = slope @ np.diag(model.own(ratio, shape) ** 2) @ slope.T
            if one.tip.pyramid:
                pyramid[rows, rows] = slope @ np.diag(PYRAMID[: model.count] ** 2) @ slope.T
            deviations = model.common(ratio, shape).reshape(-1, model.count)
            columns[rows, :, : model.count] = slope[:, None, :] * deviations
        columns = columns.reshape(size, -1)
        cells += columns @ columns.T
        return data, own, cells, pyramid

    # ---- optimum ----

    def start(self):
        """Materials to begin with: yield stress from C at some E/yield stress and some shapes."""
        found = []
        one = self.observed[0]
        shapes = [self.low[2:] + s * (self.high[2:] - self.low[2:]) for s in (0.05, 0.4, 0.75)]
        for shape in shapes if self.law.flows else [()]:
            for ratio in (20.0, 80.0, 300.0) if self.law.flows else (1.0,):
                p = np.array([0.0, -np.log(ratio) - np.log(1 - TABLE_POISSON**2), *shape][: len(self.low)])
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
                    lambda p: self.residual(p, root), first, bounds=(self.low - 1e-9, self.high), x_scale=0.1
                )
                if best is None or found.cost < best.cost or sweep > 0 and first is starts[0]:
                    best = found
            root = np.linalg.inv(
                np.linalg.cholesky(sum(self.covariances(best.x)) + 1e-12 * np.eye(len(middle)))
            )
        return best, root

    def ridge(self, best, root):
        """The optimum, and the optima at fixed values of the law's first coordinate whose chi2 is near the
        least, with their covariances."""
        found = [(best.x, self.spread(best.x, root))]
        if len(best.x) < 3:
            return found
        step = (self.high[2] - self.low[2]) / (RIDGE - 1)
        for value in np.linspace(self.low[2], self.high[2], RIDGE):
            low, high = np.array(self.low), np.array(self.high)
            low[2], high[2] = value - 1e-6, value + 1e-6
            near = min(found, key=lambda one: abs(one[0][2] - value))[0]
            result = least_squares(
                lambda p: self.residual(p, root), np.clip(near, low, high), bounds=(low, high), x_scale=0.1
            )
            result.x[2] = value  # at an edge of the range exactly that
            if result.cost < best.cost + 2 * ABOVE:
                found.append((result.x, self.spread(result.x, root, step)))
        return found

    def spread(self, p, root, step=np.inf):
        """Covariance of p at an optimum, its first coordinate within about a step."""
        jacobian = self.slope(p, root)
        information = jacobian.T @ jacobian + np.diag(self.wide**-2)
        for k, (_, sigma) in self.priors.items():
            information[k, k] += 1 / sigma**2
        if np.isfinite(step):
            information[2, 2] += 1 / step**2
        return np.linalg.inv(information)

    def outside(self, p):
        """How far E over yield stress is beyond what the runs cover, in 2 %."""
        if not self.law.flows:
            return np.zeros(0)
        ratio = np.log(self.ratio(p))
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
        ridge = self.ridge(best, root)
        covariance = ridge[0][1]
        if self.chains:
            draws, weights, values = self.run_chains(best.x, covariance, root, seed)
        else:
            draws, weights, values = self.sample(ridge, root, seed)
        draws, weights, values = self.with_ridge(ridge, root, draws, weights, values)
        chi2 = float(self.chi2(best.x, root))
        least = float(values.min())  # the optimum may lie at, or beyond, the edge of what the runs cover
        inside = values <= (least if least > chi2 + 0.5 else min(chi2, least)) + ABOVE
        result = Answer(
            self.law, np.array([*np.exp(best.x[:2]), *np.clip(best.x[2:], self.low[2:], self.high[2:])]),
            covariance, chi2, max(len(self.values) - len(best.x), 0), draws, weights, inside, jacobian,
        )  # fmt: skip
        self.intervals(result, best.x)
        return result

    def with_ridge(self, ridge, root, draws, weights, values):
        """Draws, weights, chi2, and those of the optima along the ridge, of no weight: they reach the edges
        of the first coordinate, which no draw does."""
        optima = np.array([p for p, _ in ridge])
        optima = np.clip(optima, self.low, self.high)
        chi2 = self.bounded(optima, root)
        some = np.isfinite(chi2)
        none = np.zeros(np.count_nonzero(some))
        return (
            np.concatenate([draws, optima[some]]), np.concatenate([weights, none]),
            np.concatenate([values, chi2[some]]),
        )  # fmt: skip

    def slope(self, p, root):
        columns = []
        for k in range(len(p)):
            ahead, behind = np.array(p), np.array(p)
            ahead[k] += 1e-4
            behind[k] = max(behind[k] - 1e-4, self.low[k])
            columns.append(root @ (self.predict(ahead) - self.predict(behind)) / (ahead[k] - behind[k]))
        return np.stack(columns, axis=-1)

    def allowed(self, draws):
        """Whether each is within what the runs cover."""
        inside = np.all((draws >= self.low) & (draws <= self.high), axis=1)
        if self.law.flows:
            ratio = self.ratio(draws)
            inside &= (ratio > surrogate.RATIOS[0]) & (ratio < surrogate.RATIOS[1])
        return inside

    def bounded(self, draws, root):
        """chi2 of draws; infinite of those that are not allowed."""
        inside = self.allowed(draws)
        chi2 = np.full(len(draws), np.inf)
        if np.any(inside):
            chi2[inside] = self.chi2(draws[inside], root)
        return chi2

    def run_chains(self, centre, covariance, root, seed):
        """Draws of emcee, all of one weight."""
        import emcee

        size, walkers, rng = len(centre), 8 * len(centre), np.random.default_rng(seed)
        first = np.empty((0, size))
        while len(first) < walkers:
            more = rng.multivariate_normal(centre, 0.3 * covariance, walkers)
            first = np.concatenate([first, more[self.allowed(more)]])
        sampler = emcee.EnsembleSampler(
            walkers, size, lambda draws: -0.5 * self.bounded(draws, root), vectorize=True
        )
        sampler.random_state = np.random.RandomState(seed).get_state()
        sampler.run_mcmc(first[:walkers], CHAIN)
        draws = sampler.get_chain(discard=CHAIN // 4, flat=True)
        chi2 = -2 * sampler.get_log_prob(discard=CHAIN // 4, flat=True)
        return draws, np.full(len(draws), 1 / len(draws)), chi2

    def sample(self, ridge, root, seed):
        """Draws (ln E*, ln yield stress, coordinates) and weights that sum to 1."""
        freedom, size = 5.0, len(ridge[0][0])
        uniform = qmc.Sobol(size + 1, seed=seed).random(DRAWS)
        normal = norm.ppf(np.clip(uniform[:, :size], 1e-9, 1 - 1e-9))
        stretch = np.sqrt(freedom / chi2_law.ppf(np.clip(uniform[:, size], 1e-9, 1 - 1e-9), freedom))
        parts = [(centre, 1.3**2 * covariance) for centre, covariance in ridge]
        of = np.random.default_rng(seed).permutation(DRAWS) % len(parts)  # Sobol points alternate
        for _ in range(4):
            factors = [np.linalg.cholesky(spread + 1e-14 * np.eye(size)) for _, spread in parts]
            z = normal * stretch[:, None]
            draws = np.empty_like(z)
            for k, (centre, _) in enumerate(parts):
                draws[of == k] = centre + z[of == k] @ factors[k].T
            log_q = -np.inf
            for (centre, _), factor in zip(parts, factors):
                away = np.linalg.solve(factor, (draws - centre).T)
                one = -0.5 * (freedom + size) * np.log1p(np.sum(away**2, axis=0) / freedom)
                log_q = np.logaddexp(log_q, one - np.sum(np.log(np.diag(factor))))
            chi2 = self.bounded(draws, root)
            log_p = -0.5 * chi2
            weight = np.exp(log_p - log_q - np.max(log_p - log_q))
            weight /= weight.sum()
            if 1 / np.sum(weight**2) > 0.2 * DRAWS or len(parts) > 2:
                break
            for k, (centre, _) in enumerate(parts):
                some = np.where(of == k, weight, 0.0)
                if some.sum() > 1e-3:
                    some /= some.sum()
                    apart = draws - some @ draws
                    spread = 1.5 * (apart * some[:, None]).T @ apart + 1e-8 * np.eye(size)
                    parts[k] = some @ draws, spread
        kept = (weight > 1e-3 / DRAWS) | (chi2 <= chi2.min() + ABOVE)
        return draws[kept], weight[kept] / weight[kept].sum(), chi2[kept]

    def intervals(self, answer, optimum):
        draws = answer.draws
        young, yielding, shape = self.material(draws)
        quantities = {"modulus": np.exp(draws[:, 0])}
        curve = []
        if self.law.flows:
            at = lambda strain: self.law.stress(young, yielding, shape, strain)
            quantities["yield_stress"] = yielding
            quantities |= dict(zip(self.law.names, self.law.constants(yielding, shape)))
            curve = np.stack([at(strain) for strain in STRAINS], axis=0)
            spread = [weighted_std(np.log(row), answer.weights) for row in curve]
            answer.strain = float(STRAINS[int(np.argmin(spread))])
            quantities |= {"stress_0.033": at(0.033), "stress_best": at(answer.strain)}
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
        tail = 0.5 * (1 - LEVEL)
        low, middle, high = quantile(values, answer.weights, [tail, 0.5, 1 - tail])
        some = values[answer.inside]
        return min(float(some.min()), float(low)), float(middle), max(float(some.max()), float(high))

    def profile(self, name, values, root, start):
        """chi2 at given values of a parameter (number of p), the others free."""
        size = len(start)
        others = [k for k in range(size) if k != name]
        found, x = [], np.array(start)
        for value in values:

            def residual(y, value=value):
                p = np.empty(size)
                p[name], p[others] = value, y
                return self.residual(p, root)

            low, high = self.low[others], self.high[others]
            first = np.clip(x[others], low + 1e-6, high - 1e-6)
            result = least_squares(residual, first, bounds=(low, high))
            x[others] = result.x
            found.append(2 * result.cost)
        return np.array(found)


def weighted_std(values, weights):
    mean = weights @ values
    return float(np.sqrt(weights @ (values - mean) ** 2))


def quantile(values, weights, shares):
    values, weights = values[weights > 0], weights[weights > 0]
    order = np.argsort(values)
    sums = np.cumsum(weights[order]) - 0.5 * weights[order]
    return [float(np.interp(share, sums, values[order])) for share in shares]
