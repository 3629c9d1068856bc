"""What a study makes of its numbers: errors of curves, orders, Richardson's limit, Pareto fronts, and answers
read from them."""

import math

import numpy as np


class NoOrder(Exception):
    """Three grids do not converge; the text says how they lie."""


def norms(curve, reference):
    """Root mean square and largest difference of two curves on the same places, per cent of the reference's
    largest magnitude."""
    scale = np.max(np.abs(reference))
    off = np.abs(np.asarray(curve) - reference)
    return 100 * float(np.sqrt(np.mean(off**2)) / scale), 100 * float(np.max(off) / scale)


def fitted_order(sizes, errors):
    """Slope of the line fitted through log(error) over log(size); None with less than two sizes."""
    sizes, errors = np.asarray(sizes, float), np.asarray(errors, float)
    good = np.isfinite(errors) & (errors > 0)
    if np.unique(sizes[good]).size < 2:
        return None
    return float(np.polyfit(np.log(sizes[good]), np.log(errors[good]), 1)[0])


def richardson(sizes, curves):
    """The limit of three or more curves on the same places, from the three finest sizes, and the order p that
    they show: f(h) = limit + c h^p. NoOrder when their differences do not fall, or fall as no p from 0.2 to 8
    makes them."""
    order = np.argsort(sizes)[::-1][-3:]
    if len(order) < 3:
        raise NoOrder(f"three grids are needed, there are {len(order)}")
    h = np.asarray(sizes, float)[order]
    coarse, middle, fine = (np.asarray(curves[i], float) for i in order)
    last = middle - fine
    if not np.any(last != 0):
        raise NoOrder("the two finest grids give the same bits")
    ratio = float(np.sum((coarse - middle) * last) / np.sum(last**2))

    def expected(p):
        return (h[0] ** p - h[1] ** p) / (h[1] ** p - h[2] ** p)

    low, high = 0.2, 8.0
    if not expected(low) <= ratio <= expected(high):
        raise NoOrder(
            f"the change from {h[0]:.4g} to {h[1]:.4g} is {ratio:.3g} times that from {h[1]:.4g} to "
            f"{h[2]:.4g}; with an "
            f"order of 0.2 to 8 it would be {expected(low):.3g} to {expected(high):.3g} times"
        )
    for _ in range(60):
        half = 0.5 * (low + high)
        low, high = (half, high) if expected(half) < ratio else (low, half)
    p = 0.5 * (low + high)
    return fine - last * h[2] ** p / (h[1] ** p - h[2] ** p), p


def pareto(costs, errors):
    """Indices, cheapest first, of the points that no other beats: none is at most as dear and better, or
    cheaper and as good."""
    front, best = [], math.inf
    for i in sorted(range(len(costs)), key=lambda i: (costs[i], errors[i])):
        if errors[i] < best:
            front.append(i)
            best = errors[i]
    return front


class Front:
    """The Pareto front of points (cost, error): straight lines between its points in logarithms, and beyond
    its best point the line fitted to its three best, as far as `reach` times the cost."""

    reach = 10.0

    def __init__(self, costs, errors):
        pairs = [
            (c, e) for c, e in zip(costs, errors) if c > 0 and e > 0 and math.isfinite(c) and math.isfinite(e)
        ]
        chosen = pareto([c for c, _ in pairs], [e for _, e in pairs])
        self.costs = np.array([pairs[i][0] for i in chosen])
        self.errors = np.array([pairs[i][1] for i in chosen])

    def cost_of(self, error):
        """What an error costs and '', or 'extrapolated'; None and why not."""
        if len(self.costs) == 0 or error > self.errors[0] * (1 + 1e-12):
            return None, "no run is so cheap"
        if error >= self.errors[-1] * (1 - 1e-12):
            return math.exp(
                float(np.interp(math.log(error), np.log(self.errors[::-1]), np.log(self.costs[::-1])))
            ), ""
        slope = self.last_slope()
        if slope is None:
            return None, "one run alone"
        cost = self.costs[-1] * (error / self.errors[-1]) ** (1 / slope)
        return (
            (float(cost), "extrapolated")
            if cost <= self.reach * self.costs[-1]
            else (None, "too far beyond the best run")
        )

    def error_for(self, cost):
        """The error that a cost buys and '', or 'extrapolated'; None and why not."""
        if len(self.costs) == 0 or cost < self.costs[0] * (1 - 1e-12):
            return None, "no run is so cheap"
        if cost <= self.costs[-1] * (1 + 1e-12):
            return math.exp(float(np.interp(math.log(cost), np.log(self.costs), np.log(self.errors)))), ""
        slope = self.last_slope()
        if slope is None:
            return None, "one run alone"
        if cost > self.reach * self.costs[-1]:
            return None, "too far beyond the best run"
        return float(self.errors[-1] * (cost / self.costs[-1]) ** slope), "extrapolated"

    def last_slope(self):
        """Of log(error) over log(cost), of the three best points; None with one."""
        if len(self.costs) < 2:
            return None
        return float(np.polyfit(np.log(self.costs[-3:]), np.log(self.errors[-3:]), 1)[0])


def ratio_at_equal_error(one, other):
    """Cost of one front over that of another where their errors overlap: geometric mean, least, most, and the
    range of errors. None when they do not overlap. A front of one run is compared at its error, also where
    that is up to a tenth beyond the other's best."""
    if len(one.errors) == 0 or len(other.errors) == 0:
        return None
    low, high = max(one.errors[-1], other.errors[-1]), min(one.errors[0], other.errors[0])
    single = min((one, other), key=lambda front: len(front.errors))
    if len(single.errors) == 1:
        low = high = single.errors[0]
        full = other if single is one else one
        if len(full.errors) < 2 or not 0.9 * full.errors[-1] <= low <= full.errors[0]:
            return None
        ratio = (
            one.costs[0] / full.cost_of(low)[0] if single is one else full.cost_of(low)[0] / other.costs[0]
        )
        return float(ratio), float(ratio), float(ratio), (low, high)
    if low >= high:
        return None
    ratios = [one.cost_of(e)[0] / other.cost_of(e)[0] for e in np.geomspace(low, high, 41)]
    return float(np.exp(np.mean(np.log(ratios)))), min(ratios), max(ratios), (low, high)


def halved(order, size, other, change):
    """What halving a size would change, from what the step between it and another, finer or coarser, changed,
    at this order."""
    return change * (1 - 0.5**order) / abs(1 - (other / size) ** order)
