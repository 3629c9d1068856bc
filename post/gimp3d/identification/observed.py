"""What the curves under one tip say, as few numbers with their covariance: C, the work that comes back over
load times depth (the mean recovery), the power of the unloading; of a tip that has a length also the power of
the loading and how it changes, about the depth of the tip's runs. Zero of the depth, compliance of the frame
and drift may be free; they widen the covariance.

Load and depth of a row both scatter (errors in variables): by e and -k e + d, where e and d are independent
and k is what depths follow loads by, as where a compliance was taken off with the measured load. To first
order the residual of a row is a e_load - b e_depth, so that its variance is (a + k b)^2 var e + b^2 var d; a
and b are slopes of the curve. Residuals over the root of that are their distances from the curve, in sigmas
(Deming's fit): a and b are those of the curve that is tried, for with held ones a curve would gain by small
slopes, which make residuals small. The three numbers of the noise are held in a fit. They follow from
differences of neighbouring residuals of the fit before it, which a smooth curve hardly has, by their
likelihood, the logarithms of the variances included."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import least_squares, minimize

from .. import oliver_pharr
from . import forward, measured

LOADING = (0.3, 1.0)  # shares of the depth that are fitted
UNLOADING = (0.05, 0.95)  # shares of the load
FREE = ("zero", "compliance", "drift")
WIDTHS = {"zero": 0.05, "compliance": 0.5, "drift": 0.05}  # of the steps in them: shares of the depth
DRIFT = 0.02  # one sigma of what a drift may add to the depth, as a share
MORE = 0.05  # one sigma of the logarithm by which noise is above what differences of the rows say
LEAST = 0.2  # of the median sigma of the rows: none counts as better
FINEST = 1e-5  # of the largest load: no load is better known
SWEEPS = 6  # of fit and noise
STEP = 0.1  # of logarithms of the noise: second derivatives of its likelihood
SETTLED = 1e-4  # of x, from sweep to sweep
ALIKE = 2.31  # third differences of white noise that count as one: the sum of their squared correlations
JUMP = 10.0  # times the median: larger differences are no noise
SWING = 25  # rows that a smooth motion is the mean of
TURN = 3.0  # scatters of a row: one sigma of the depth at which the unloading begins
NEAR = 0.85  # of that depth: rows that its load is taken from
POWER = 0.016  # of the loading of the runs of sharp cones, rms about 2: what is left of their cells
WIDE = 3.0  # one sigma of any x beforehand, where drifts are given
UNLIKELY = 15.0  # of -ln of the likelihood beyond the least: leaves no trace in means
UNUSUAL = 4.0  # sigmas: further off, the model does not fit
DEFAULT_SIGMA = {"curvature": 0.01, "stiffness": 0.03, "work_ratio": 0.005, "residual_ratio": 0.01}


class NoUnloading(Exception):
    """A curve has no way back that could be fitted."""


@dataclass
class Observed:
    """Values y of a tip with covariance; `of(features)` gives y from ln C (Pa), ln of the mean recovery,
    1/m, and of a tip with a length the power of the loading and its change."""

    tip: object
    names: list
    values: np.ndarray
    covariance: np.ndarray
    of: object
    curves: list = field(default_factory=list)
    corrections: dict = field(default_factory=dict)  # zero (m), compliance (m/N), drift (m/s): value, sigma
    rows: list = field(default_factory=list)  # of the curves that are fitted: name, depth, load, share
    noise: float = 0.0  # of the load over its largest, one sigma
    depth: float = 0.0  # the largest
    depth_noise: float = 0.0  # m, one sigma, of what does not follow the load
    unusual: list = field(default_factory=list)  # sentences on what does not fit


@dataclass
class Segments:
    """One curve in parts: rows of the loading, of the unloading, and where it turns."""

    name: str
    h_in: np.ndarray
    p_in: np.ndarray
    t_in: np.ndarray
    h_out: np.ndarray
    p_out: np.ndarray
    t_out: np.ndarray
    top: float
    top_sigma: float  # m
    load: float
    time: float
    load_sigma: float  # one sigma of `load`, as a share
    held: bool  # at the turn: `load` is no load of the loading
    begin: float  # time at which the depth begins
    scatter: tuple  # of single rows about a smooth motion, one sigma: load (N), depth (m)


def check_order(curve):
    """Raises Unreadable where the rows are not in the order in which they were measured."""
    if curve.time is not None and np.median(np.diff(curve.time)) < 0:
        raise measured.Unreadable(
            f"{curve.name}: the times fall from row to row; sort the rows by their time"
        )
    steps = np.diff(curve.depth)
    done = np.sum(0.5 * (curve.load[1:] + curve.load[:-1]) * steps)
    size = np.sum(0.5 * np.abs(curve.load[1:] + curve.load[:-1]) * np.maximum(steps, 0.0))
    scatter = np.max(curve.load) * oliver_pharr.depth_noise(curve.depth) + np.max(
        curve.depth
    ) * oliver_pharr.depth_noise(curve.load)
    if done < -0.02 * size - 3 * scatter:
        raise measured.Unreadable(
            f"{curve.name}: the tool gets back more work than it has done ({1e9 * done:.3g} nJ are left): "
            "the rows are not in the order in which they were measured; sort them by their time"
        )


def turn_of(curve, way, rows):
    """Depth (m) at which the unloading begins, its sigma, the load there (N), its sigma, whether the tool was
    held there. Depths that scatter turn nowhere exactly: the fit finds the depth, within TURN scatters."""
    depth, load = curve.depth, curve.load
    noise = oliver_pharr.depth_noise(depth)
    scatter = oliver_pharr.depth_noise(load)
    if way.start - way.hold >= oliver_pharr.hold_rows:
        held = depth[way.hold + (way.start - way.hold) // 2 : way.start + 1]
        noisy = oliver_pharr.noise_band * noise > oliver_pharr.hold_share * np.max(depth)
        top = float(oliver_pharr.end_of(held)) if noisy else float(depth[way.start])
        value, sigma = oliver_pharr.load_at_start(depth, load, way, scatter)
        return top, TURN * noise, value, sigma, True
    top = float(depth[way.start])
    near = rows[depth[rows] >= NEAR * top]
    if len(near) < 8:
        return top, TURN * noise, float(load[way.start]), scatter, False
    x = depth[near] / top - 1
    base = np.stack([np.ones(x.size), x, x**2], axis=1)
    found, *_ = np.linalg.lstsq(base, load[near], rcond=None)
    residual = load[near] - base @ found
    apart = float(residual @ residual) / (x.size - 3) * oliver_pharr.correlation_time(residual)
    sigma = float(np.sqrt(apart * np.linalg.inv(base.T @ base)[0, 0]))
    return top, TURN * noise, float(found[0]), sigma, False


def swing_of(depth):
    """How far depths swing about a smooth motion (m), as where a stiffness is measured all the way: rows of
    the loading are so far below the largest depth before them."""
    if len(depth) < 2 * SWING:
        return 0.0
    mean = np.convolve(depth, np.ones(SWING) / SWING, mode="valid")
    return 4 * float(np.median(np.abs(depth[SWING // 2 : SWING // 2 + len(mean)] - mean)))


def segments(curve):
    check_order(curve)
    depth, load = curve.depth, curve.load
    time = curve.time if curve.time is not None else np.arange(len(depth), dtype=float)
    ways = oliver_pharr.find_unloadings(depth, load)
    if not ways:
        least = float(np.min(load[int(np.argmax(load)) :]) / np.max(load))
        raise NoUnloading(
            f"{curve.name}: the curve has no unloading: after the largest load the depth does not fall by "
            f"more than its scatter ({1e9 * oliver_pharr.depth_noise(depth):.3g} nm), and the load only to "
            f"{100 * max(least, 0.0):.3g} % of the largest"
        )
    way = max(ways, key=lambda one: depth[one.start])
    rows = oliver_pharr.virgin_rows(depth, way.hold, swing_of(depth[: way.hold + 1]))
    begin = float(time[rows[0]]) if len(rows) else 0.0
    top, top_sigma, turn_load, load_sigma, held = turn_of(curve, way, rows)
    rows = rows[(depth[rows] >= LOADING[0] * depth[way.start])]
    back = np.arange(way.start, way.end + 1)
    share = load[back] / turn_load
    gone = np.flatnonzero(share < UNLOADING[0])
    back = back[: gone[0]] if gone.size else back
    back = back[load[back] / turn_load < UNLOADING[1]]
    if len(rows) < 8 or len(back) < 8:
        raise NoUnloading(
            f"{curve.name}: {len(rows)} rows of loading, {len(back)} of unloading; at least 8 of each are "
            "required"
        )
    return Segments(
        curve.name, depth[rows], load[rows], time[rows], depth[back], load[back], time[back],
        top, top_sigma, turn_load, float(time[way.start]), load_sigma / turn_load + FINEST, held, begin,
        (oliver_pharr.depth_noise(load), oliver_pharr.depth_noise(depth)),
    )  # fmt: skip


@dataclass
class Noise:
    """Of the rows of one curve: sigma of the load (N) and of the depth (m), and what depths follow loads by
    (k, m/N); factors of the sigmas of loading and unloading by what rows show beyond their differences."""

    load: float
    depth: float = 0.0
    together: float = 0.0
    factors: tuple = (1.0, 1.0)
    others: list = field(default_factory=list)  # pairs of Noise, one sigma to both sides: its own uncertainty

    def sigmas(self, of_load, of_depth, finest):
        """One sigma of residuals of_load e_load - of_depth e_depth; none is far below their median."""
        found = self.load**2 * (of_load + self.together * of_depth) ** 2 + (self.depth * of_depth) ** 2
        found = np.sqrt(found + (finest * of_load) ** 2)
        return np.maximum(found, LEAST * np.median(found))

    @staticmethod
    def of_differences(parts, curve, before=None):
        """The Noise of parts (residual, of_load, of_depth) of a curve, from differences of neighbouring
        residuals. A smooth curve has hardly any; their sizes follow an exponential distribution, on which
        single jumps have little effect. The third differences of load and depth (curve.scatter) are upper
        bounds. Where the motion is smooth they are also estimates; it may not be, so they enter with a Cauchy
        distribution, whose tails allow smaller values. before: the Noise of the sweep before."""
        load, depth = curve.load, curve.top
        apart, of_load, of_depth = (
            np.concatenate([0.5 * (one[k][1:] + one[k][:-1]) if k else np.diff(one[0]) for one in parts])
            for k in range(3)
        )
        apart, of_depth = np.abs(apart) / (np.sqrt(4 / np.pi) * load), of_depth * depth / load
        most = np.maximum(np.array(curve.scatter) / (load, depth), FINEST)
        low = np.log(0.1 * FINEST)
        k, k_sigma = (one * load / depth for one in follows(curve))

        def unlikely(y):
            """-ln of the likelihood; y over the largest: ln of the load's sigma, of the depth's own, k."""
            variance = np.exp(2 * y[0]) * (of_load + y[2] * of_depth) ** 2 + (np.exp(y[1]) * of_depth) ** 2
            sigma = np.sqrt(variance + (FINEST * of_load) ** 2)
            whole = np.exp(y[0]), np.hypot(np.exp(y[1]), y[2] * np.exp(y[0]))
            beyond = np.log(whole / most) / MORE
            smooth = np.log1p(np.minimum(beyond, 0.0) ** 2).sum() + np.log1p(((y[2] - k) / k_sigma) ** 2)
            return np.sum(np.log(sigma) + apart / sigma) + 0.5 * np.sum(np.maximum(beyond, 0.0) ** 2) + smooth

        at = np.clip(np.log(most), low, 1)
        reach = float(min(most[1] / most[0], 1.0))
        firsts = [
            [at[0], low + 1, 0.0], [low + 1, at[1], 0.0], [at[0], at[1], 0.0],
            [at[0], at[1], np.clip(k, -reach, reach)],
            [at[0], at[1] - 2, 0.9 * reach], [at[0], at[1] - 2, -0.9 * reach],
        ]  # fmt: skip
        if before is not None:
            size = np.log([max(before.load / load, 1e-9), max(before.depth / depth, 1e-9)])
            firsts = [[*np.clip(size, low, 1), before.together * load / depth]]
        best = None
        for first in firsts:
            found = minimize(unlikely, first, method="L-BFGS-B", bounds=[(low, 1), (low, 1), (-1, 1)])
            if best is None or found.fun < best.fun:
                best = found
        noise_of = lambda y: Noise(np.exp(y[0]) * load, np.exp(y[1]) * depth, y[2] * depth / load)
        found = noise_of(best.x)
        unit = np.array([STEP, STEP, STEP * max(reach, 1e-3)])
        values, ways = np.linalg.eigh(curvature(lambda y: unlikely(best.x + unit * y), 3))
        for value, way in zip(values, ways.T):
            step = unit * way / np.sqrt(max(value, STEP**2))
            found.others.append((noise_of(best.x + step), noise_of(best.x - step)))
        return found


def follows(curve):
    """By what depths follow loads (k, m/N) in third differences, and its sigma; any where loads do not
    scatter."""
    depth, load = (
        np.concatenate([np.diff(one, 3) for one in pair])
        for pair in ((curve.h_in, curve.h_out), (curve.p_in, curve.p_out))
    )
    some = np.all([np.abs(one) <= JUMP * np.median(np.abs(one)) for one in (load, depth)], axis=0)
    size = float(load[some] @ load[some])
    unit = curve.top / curve.load
    if size <= (FINEST * curve.load) ** 2 * np.count_nonzero(some):
        return 0.0, unit
    value = -float(load[some] @ depth[some]) / size
    left = depth[some] + value * load[some]
    return value, min(float(np.sqrt(ALIKE * left @ left / np.count_nonzero(some) / size)) + 1e-4 * unit, unit)


def curvature(function, size):
    """Second derivatives at 0, by unit steps."""
    found, steps = np.zeros((size, size)), np.eye(size)
    for i in range(size):
        for k in range(i + 1):
            corners = [a * b * function(a * steps[i] + b * steps[k]) for a in (1, -1) for b in (1, -1)]
            found[i, k] = found[k, i] = 0.25 * sum(corners)
    return found


def factor_of(white):
    """What sigmas are larger by than their rows' differences say: residuals over their sigmas scatter about
    their mean, and neighbours together."""
    count = white.size
    together = oliver_pharr.correlation_time(white - white.mean())
    return float(np.sqrt(np.sum(white**2) / max(count - 2, 1) * together))


def depth_of(curve):
    """The largest, m."""
    return float(np.max(curve.depth))


def from_curves(tip, curves, free=(), noise=None):
    """Observed of the curves under one tip, of about one depth where it has a length. `free`: some of FREE;
    `noise`: one sigma of the load over the largest that the fit begins with, else found from the rows."""
    for curve in curves:
        if "drift" in free and curve.time is None:
            raise measured.Unreadable(
                f"{curve.name}: FREE=drift requires a column of time, as `time [s]`; the file has none"
            )
        if "drift" in free and np.any(np.diff(curve.time) < 0):
            raise measured.Unreadable(f"{curve.name}: FREE=drift requires times that do not fall")
    parts = [segments(curve) for curve in curves]
    fit = CurveFit(tip, parts, free)
    x, noises = fit.solve(noise)
    found, covariance = fit.result(x, noises)
    names = ["ln C", "ln recovery", "1/m", "power", "change of the power"]
    return Observed(
        tip, names[: fit.size], found.x[: fit.size],
        covariance[: fit.size, : fit.size], lambda f: f,
        [part.name for part in parts], fit.corrections(found.x, covariance),
        [(curve.name, curve.depth, curve.load, None) for curve in curves],
        float(np.mean([one.load * one.factors[0] / part.load for one, part in zip(noises, parts)])),
        fit.deepest, float(np.mean([one.depth * one.factors[0] for one in noises])),
        fit.unusual(found, noises),
    )  # fmt: skip


class CurveFit:
    """Least squares of the curves under one tip. x has the features; for each curve the load where its way
    back begins and the depth there, in their sigmas; the corrections that are free, over their units."""

    def __init__(self, tip, parts, free):
        self.parts, self.bent = parts, tip.has_length
        self.deepest = max(part.top for part in parts)
        self.reference = tip.model(self.deepest)[1]  # of the runs
        self.size = 5 if self.bent else 3
        count = len(parts)
        self.begins = slice(self.size, self.size + count)
        self.turns = slice(self.size + count, self.size + 2 * count)
        self.places, self.count = {}, self.size + 2 * count
        for name in free:
            more = 1 if name == "compliance" else count
            self.places[name] = np.arange(self.count, self.count + more)
            self.count += more
        self.stiff = np.mean([part.load / part.top for part in parts])
        self.power = 0.0  # beyond 2, of a sharp tip's loading: for the test of its form

    def span(self, part):
        return max(part.t_out[-1] - part.begin, 1e-300)

    def units(self):
        """Of the corrections: m, m/N, m/s."""
        return {
            "zero": self.deepest * WIDTHS["zero"],
            "compliance": WIDTHS["compliance"] * 0.1 / self.stiff,
            "drift": WIDTHS["drift"] * self.deepest / self.span(self.parts[0]),
        }

    def compliance(self, x):
        if "compliance" not in self.places:
            return 0.0
        return x[self.places["compliance"][0]] * self.units()["compliance"]

    def corrected(self, x, number, h, p, t):
        part = self.parts[number]
        found = h - self.compliance(x) * p
        if "zero" in self.places:
            found = found - x[self.places["zero"][number]] * self.units()["zero"]
        if "drift" in self.places:
            rate = x[self.places["drift"][number]] * WIDTHS["drift"] * self.deepest / self.span(part)
            found = found - rate * (t - part.begin)
        return found

    def loading(self, x, h):
        """The load that a depth has on the way in, and its slope."""
        load, h = np.exp(x[0]) * np.maximum(h, 0) ** 2, np.maximum(h, 1e-3 * self.reference)
        if not self.bent:
            load = load * (h / self.deepest) ** self.power
            return load, (2 + self.power) * load / h
        way = np.log(h / self.reference)
        load *= np.exp((x[3] - 2) * way + x[4] * way**2)
        return load, (x[3] + 2 * x[4] * way) * load / h

    def rows(self, x, number):
        """Residuals of loading (N) and unloading (share of the depth) of a curve; each with what an error of
        the load (N) and of the depth (m) changes it by, to first order."""
        part, compliance = self.parts[number], self.compliance(x)
        h_in = self.corrected(x, number, part.h_in, part.p_in, part.t_in)
        load, rise = self.loading(x, h_in)
        off = x[self.turns][number] * part.top_sigma
        begin = part.load * np.exp(x[self.begins][number] * part.load_sigma)
        if not part.held:  # it is on the loading, where that has this depth
            begin *= (1 + off / part.top) ** 2
        turn = self.corrected(x, number, part.top + off, begin, part.time)
        h_out = self.corrected(x, number, part.h_out, part.p_out, part.t_out)
        share = np.clip(part.p_out / begin, 1e-6, 1)
        fallen = begin / max(self.loading(x, np.array([turn]))[0][0], 1e-300)  # of a hold at a given depth
        recovered, inverse = forward.full_recovery(np.exp(x[1]), x[2]) * fallen, x[2]
        slope = recovered * inverse * share ** (inverse - 1) / begin
        back = 1 - h_out / turn - recovered * (1 - share**inverse)
        return (
            (part.p_in - load, 1 + compliance * rise, rise),
            (back, compliance / turn + slope, np.full(h_out.size, 1 / turn)),
        )

    def white(self, x, noises):
        """Residuals over their sigmas, one array a segment."""
        found = []
        for number, (one, part) in enumerate(zip(noises, self.parts)):
            for factor, (left, *of_errors) in zip(one.factors, self.rows(x, number)):
                found.append(left / (factor * one.sigmas(*of_errors, FINEST * part.load)))
        return found

    def expected(self, x):
        """What is known before, in sigmas: loads and depths of the turns, drifts."""
        drift = [x[self.places["drift"]] * WIDTHS["drift"] / DRIFT] if "drift" in self.places else []
        return np.concatenate([x[self.begins], x[self.turns], *drift])

    def start(self):
        first, x = self.parts[0], np.zeros(self.count)
        back = float(np.max(1 - first.h_out / first.top))
        x[:3] = np.log(first.load / first.top**2), np.log(max(0.4 * back, 1e-3)), 0.7
        if self.bent:
            x[3] = 1.5
        if "compliance" in self.places:
            x[self.places["compliance"]] = 0.02
        return x

    def bounds(self):
        low, high = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        low[1], high[1] = -15.0, 1.0
        low[2], high[2] = 0.3, 1.0
        if "compliance" in self.places:
            low[self.places["compliance"]] = 0
        return low, high

    def least(self, x, noises):
        return least_squares(
            lambda x: np.concatenate([*self.white(x, noises), self.expected(x)]),
            x, bounds=self.bounds(), x_scale=0.1, method="trf",
        )  # fmt: skip

    def noises(self, x, before):
        """The Noise of each curve, at x; before: those of the sweep before, if any."""
        found = []
        for number, part in enumerate(self.parts):
            one = Noise.of_differences(
                self.scaled(x, number), part, before[number] if before else None
            )
            white = [
                residual / one.sigmas(of_load, of_depth, FINEST * part.load)
                for residual, of_load, of_depth in self.rows(x, number)
            ]
            one.factors = tuple(max(factor_of(left), 0.5) for left in white)
            found.append(one)
        return found

    def scaled(self, x, number):
        """The rows of a curve; those of the unloading in units of the load (N) at its middle."""
        inward, outward = self.rows(x, number)
        unit = float(np.median(outward[1]))
        return inward, tuple(one / unit for one in outward)

    def solve(self, noise):
        """x and the Noise of each curve."""
        x = self.start()
        noises = [Noise((noise or 0.01) * part.load) for part in self.parts]
        for sweep in range(SWEEPS):
            last, x = x, self.least(x, noises).x
            noises = self.noises(x, noises if sweep > 1 else None)
            if sweep > 2 and np.all(np.abs(x - last) < SETTLED):
                break
        return x, noises

    def result(self, x, noises):
        """The last fit and its covariance, to which one sigma of the noise adds what it moves the fit by."""
        found = self.least(x, noises)
        scale = np.sqrt((found.jac**2).sum(axis=0)) + 1e-300
        inverse = np.linalg.pinv((found.jac / scale).T @ (found.jac / scale), rcond=1e-12)
        covariance, more = inverse / np.outer(scale, scale), np.zeros_like(inverse)
        for number, one in enumerate(noises):
            for pair in one.others:
                ends = []
                for other in pair:
                    other.factors = one.factors
                    ends.append(self.least(found.x, [*noises[:number], other, *noises[number + 1 :]]).x)
                more += np.outer(ends[0] - ends[1], ends[0] - ends[1]) / 4
        if "drift" in self.places and len(self.parts) == 1:
            found.x, covariance = self.along_drift(found.x, covariance, noises)
        return found, covariance + more

    def along_drift(self, x, covariance, noises):
        """Mean and covariance of x, where the drift of the one curve is not normally distributed: those of
        the fits at given drifts, by their likelihood. A drift stands for a part of what comes back, which
        changes little on one side and soon ends on the other."""
        place, known = self.places["drift"][0], DRIFT / WIDTHS["drift"]
        sigma = np.sqrt(covariance[place, place])
        drifts = x[place] + sigma * np.arange(-5, 6)
        if sigma > 0.1 * known:
            drifts = np.union1d(drifts, known * np.linspace(-4, 4, 17))
        low, high = (np.delete(bound, place) for bound in self.bounds())
        means, covariances, chances, kept, least = [], [], [], [], self.least(x, noises).cost
        for drift in drifts:
            whole = lambda y: np.insert(y, place, drift)
            at = least_squares(
                lambda y: np.concatenate([*self.white(whole(y), noises), self.expected(whole(y))]),
                np.delete(x, place), bounds=(low, high), x_scale=0.1, method="trf",
            )  # fmt: skip
            if not at.cost < least + UNLIKELY:
                continue
            kept.append(drift)
            information = at.jac.T @ at.jac + WIDE**-2 * np.eye(len(at.x))
            scale = np.sqrt(np.diag(information))
            inner = information / np.outer(scale, scale)
            own = np.linalg.inv(inner) / np.outer(scale, scale)
            means.append(whole(at.x))
            covariances.append(np.insert(np.insert(own, place, 0.0, axis=0), place, 0.0, axis=1))
            chances.append(-at.cost - np.log(scale).sum() - 0.5 * np.linalg.slogdet(inner)[1])
        if len(kept) < 3:
            return x, covariance
        chances = np.exp(np.array(chances) - max(chances)) * np.gradient(kept)
        chances /= chances.sum()
        mean = chances @ np.array(means)
        spread = np.array(means) - mean
        return mean, np.tensordot(chances, covariances, 1) + (spread.T * chances) @ spread

    def corrections(self, x, covariance):
        """zero (m), compliance (m/N), drift (m/s): value and sigma of each curve."""
        found = {}
        for name, place in self.places.items():
            unit = self.units()[name]
            found[name] = [(float(x[i] * unit), float(np.sqrt(covariance[i, i]) * unit)) for i in place]
        return found

    def unusual(self, found, noises):
        """Sentences on what does not fit: the form of a sharp tip's loading; what was expected of a drift and
        of the turns."""
        said = []
        names = [f"the load at the start of the unloading of {part.name}" for part in self.parts]
        names += [f"the largest depth of {part.name}" for part in self.parts]
        names += [f"the drift of {self.parts[k].name}" for k in range(len(self.places.get("drift", ())))]
        for name, off in zip(names, self.expected(found.x)):
            if abs(off) > UNUSUAL:
                said.append(
                    f"The model does not fit the data: {name} is {abs(off):.2g} sigma from what is expected "
                    "of it beforehand. Leave out what is free, or give a drift and a compliance that were "
                    "measured. The intervals are not valid."
                )
        if not self.bent:
            power, sigma = self.power_of_loading(found.x, noises)
            if abs(power) > UNUSUAL * np.hypot(sigma, POWER):
                said.append(self.wrong_form(power, sigma))
        return said

    def power_of_loading(self, x, noises):
        """The power of the loading beyond 2, and its sigma, where it is free beside all else. The sigma is by
        the scatter about that fit: about a wrong power rows would seem to scatter more."""
        white = [replace(one, factors=(1.0, 1.0)) for one in noises]

        def whole(y):
            self.power = y[-1]
            return np.concatenate([*self.white(y[:-1], white), self.expected(y[:-1])])

        low, high = self.bounds()
        found = least_squares(
            whole, [*x, 0.0], bounds=([*low, -1.5], [*high, 4.0]), x_scale=0.1, method="trf"
        )
        factors = [factor_of(one) for one in self.white(found.x[:-1], white)[::2]]
        self.power = 0.0
        scale = np.sqrt((found.jac**2).sum(axis=0)) + 1e-300
        inverse = np.linalg.pinv((found.jac / scale).T @ (found.jac / scale), rcond=1e-12)
        return float(found.x[-1]), float(np.sqrt(inverse[-1, -1]) / scale[-1] * max(*factors, 1.0))

    def wrong_form(self, power, sigma):
        names = ", ".join(part.name for part in self.parts)
        others = [name for name in ("zero", "compliance") if name not in self.places]
        what = f"set FREE={','.join([*self.places, *others])}, " if others else ""
        return (
            f"The model does not fit the data: the load of {names} rises with the power {2 + power:.3g} +- "
            f"{np.hypot(sigma, POWER):.2g} of the depth, and under a sharp tip with 2. Possible causes are a "
            f"wrong zero of the depth (rows before the contact), a rounded tip, frame compliance or drift: "
            f"{what}specify the rounding, or omit shallow rows. The intervals are not valid."
        )


def derived_of(features, depth, wanted):
    """ln C, ln S, ln(1 - Wp/Wt), ln(1 - hf/hmax) from features, in the order wanted."""
    ln_c, ln_back, inverse = features[:3]
    recovered = forward.full_recovery(np.exp(ln_back), inverse)
    found = {
        "curvature": ln_c,
        "stiffness": ln_c + np.log(depth) - np.log(recovered * inverse),
        "work_ratio": np.log(3) + ln_back,
        "residual_ratio": np.log(recovered),
    }
    return np.array([found[name] for name in wanted])


def from_derived(tip, rows):
    """Observed of indentations of which C, S, Wp/Wt, hf/hmax are known: their means, with the scatter of the
    rows where there are three or more, else what the rows or DEFAULT_SIGMA say."""
    if tip.has_length:
        raise measured.Unreadable(
            f"{rows[0].name}: derived numbers are only for sharp tips; a {tip.title} requires curves"
        )
    wanted = [name for name in DEFAULT_SIGMA if all(name in row.values for row in rows)]
    if "curvature" not in wanted:
        raise measured.Unreadable(f"{rows[0].name}: C (with its unit) is required")

    def numbers(row):
        v = row.values
        made = {
            "curvature": lambda: np.log(v["curvature"]),
            "stiffness": lambda: np.log(v["stiffness"]) - np.log(v["max_depth"]),
            "work_ratio": lambda: np.log(1 - v["work_ratio"]),
            "residual_ratio": lambda: np.log(1 - v["residual_ratio"]),
        }
        return np.array([made[name]() for name in wanted])

    def sigmas(row):
        found = []
        for name in wanted:
            sigma = row.sigma.get(name, DEFAULT_SIGMA[name])
            if name in ("work_ratio", "residual_ratio"):
                sigma = sigma / (1 - row.values[name])
            found.append(sigma)
        return np.array(found)

    table = np.array([numbers(row) for row in rows])
    if len(rows) >= 3:
        covariance = np.diag(table.var(axis=0, ddof=1) / len(rows) + 1e-6)
    else:
        covariance = np.diag(np.mean([sigmas(row) ** 2 for row in rows], axis=0) / len(rows))
    depth = float(np.mean([row.values.get("max_depth", 1e-6) for row in rows]))
    return Observed(
        tip, wanted, table.mean(axis=0), covariance, lambda f: derived_of(f, 1.0, wanted),
        [row.name for row in rows], depth=depth,
    )  # fmt: skip
