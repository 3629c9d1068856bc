"""Analysis of load-depth curves of an instrumented indentation (Oliver & Pharr, J. Mater. Res. 7 (1992) 1564
and 19 (2004) 3; ISO 14577-1), of runs or experiments.

Arrays of depth (m, from the undeformed surface) and load (N, above 0 where the tool presses) go in, plain
numbers in SI units come out. Nothing here knows of files or scenes. Uncertainties are standard deviations
(one sigma) of the three sources
   noise    the scatter of the rows about the fit, made larger where neighbouring rows scatter together
   (waves)
   window   what other shares of the unloading give, beyond what their noise explains
   area     of the area that was measured, or of the depth and the stiffness that it follows from
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import trapezoid
from scipy.optimize import least_squares
from scipy.special import gammaln

least_fall = 0.25  # of its load: an unloading by less says too little of its form
fewest_rows = 10  # of an unloading that three numbers are fitted to
turn_share = 3e-3  # of the largest depth: a way back that is shorter is no unloading
hold_share = 1e-3  # of the way back: rows so near to the largest depth are of a hold
hold_rows = 5  # of a hold whose load is a mean
noise_turn = 10  # times the scatter of single depths: a way back that is shorter may be scatter
noise_band = 8  # likewise: depths so near to the largest may be of a hold
noise_flat = 1.5  # likewise: ends of a hold are no lower below its middle
window = (0.20, 0.98)  # shares of the load at which the unloading begins (ISO 14577-1)
other_windows = ((0.3, 0.98), (0.4, 0.98), (0.5, 0.98), (0.2, 0.95), (0.2, 0.90))
loading_window = (0.5, 1.0)  # shares of the largest depth
other_loading_windows = ((0.3, 0.75), (0.3, 1.0), (0.4, 0.9), (0.7, 1.0))


class NotEnough(Exception):
    """The curve does not have what an analysis needs; the text is a sentence that says what."""


# ---- formulas ----


def epsilon_of_exponent(m):
    """The factor epsilon of the contact depth from the exponent m of the unloading: 1 for a flat punch (m =
    1), 0.75 for a paraboloid (1.5), 0.727 for a cone (2). Pharr & Bolshakov, J. Mater. Res. 17 (2002) 2660;
    ISO 14577-1:2015."""
    if m <= 1 + 1e-6:
        return 1.0
    half = 0.5 / (m - 1)
    return m * (1 - math.exp(gammaln(m * half) - gammaln(half)) / (half * math.sqrt(math.pi)))


def hay_factor(half_angle, poisson):
    """The factor beta of a rigid cone of this half angle (degrees) on an elastic half-space, whose surface
    moves sideways too. Hay, Bolshakov & Pharr, J. Mater. Res. 14 (1999) 2296: one form up to 60 degrees,
    another above."""
    slope = math.tan(math.radians(half_angle))
    sideways = (1 - 2 * poisson) / (4 * (1 - poisson) * slope)
    if half_angle <= 60:
        return 1 + sideways
    return math.pi * (math.pi / 4 + 0.15483073 * sideways) / (math.pi / 2 - 0.83119312 * sideways) ** 2


def contact_depth(depth, load, stiffness, epsilon):
    """Depth of the contact's edge below the undeformed surface plus what the tool is in beyond it: h -
    epsilon P / S."""
    return depth - epsilon * load / stiffness


def reduced_modulus(stiffness, area, beta=1.0):
    """E_r (Pa) = S sqrt(pi) / (2 beta sqrt(A)); under a rigid tool E / (1 - nu^2) of the specimen."""
    return stiffness * math.sqrt(math.pi / area) / (2 * beta)


def young_modulus(reduced, poisson, tool_young=math.inf, tool_poisson=0.0):
    """Young's modulus (Pa) of the specimen from the reduced one; the tool is rigid unless its modulus is
    given."""
    return (1 - poisson**2) / (1 / reduced - (1 - tool_poisson**2) / tool_young)


# ---- areas ----


def fitted_area(coefficients):
    """The area function (m2 of m) of an instrument: C0 h^2 + C1 h + C2 h^(1/2) + C3 h^(1/4) ..., coefficients
    for nm."""

    def area(h):
        h = max(h, 0.0) * 1e9
        return 1e-18 * sum(c * h ** (2 / 2**i) for i, c in enumerate(coefficients))

    return area


def ideal_area(shape, half_angle=None, radius=None, faces=None, tip_radius=0.0):
    """The ideal area function: projected area (m2) of a tool at a distance (m) from its tip. Angles in
    degrees, of the faces to the axis. A tip_radius rounds the end of a cone or pyramid by a sphere that
    touches its faces; beyond that circle of contact the section is that of the sharp tool, which is missing a
    piece of length r (1/sin - 1). None for shapes that have no such area: a wedge, a cylinder that lies
    across, a shape of the user's own."""
    if shape == "flat":
        return lambda h: math.pi * radius**2
    if shape == "sphere":

        def cap(h):
            h = min(max(h, 0.0), radius)
            return math.pi * h * (2 * radius - h)

        return cap
    if shape == "cone":
        form = math.pi
    elif shape in ("berkovich", "pyramid"):
        faces = 3 if shape == "berkovich" else int(faces)
        form = faces * math.tan(math.pi / faces)
    else:
        return None
    angle = math.radians(half_angle)
    missing = tip_radius * (1 / math.sin(angle) - 1)

    def area(h):
        h = max(h, 0.0)
        if h < tip_radius * (1 - math.sin(angle)):
            return math.pi * h * (2 * tip_radius - h)
        return form * math.tan(angle) ** 2 * (h + missing) ** 2

    return area


# ---- uncertainties ----


def propagate(function, values, covariance):
    """Value and standard deviation of function(values), from the covariance of the values, to first order."""
    values = np.asarray(values, dtype=float)
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    slope = np.zeros(values.size)
    for i, step in enumerate(0.1 * sigma):
        if step > 0:
            ahead, behind = values.copy(), values.copy()
            ahead[i] += step
            behind[i] -= step
            slope[i] = (function(*ahead) - function(*behind)) / (2 * step)
    return function(*values), math.sqrt(max(float(slope @ covariance @ slope), 0.0))


def correlation_time(residual):
    """How many neighbouring rows scatter as one: 1 for white noise. The sum of the autocorrelation up to
    where it first is not above what white noise would show."""
    n = residual.size
    total = float(residual @ residual)
    if n < 4 or total == 0:
        return 1.0
    time = 1.0
    for lag in range(1, max(2, n // 4)):
        share = float(residual[lag:] @ residual[:-lag]) / total
        if share <= 1 / math.sqrt(n):
            break
        time += 2 * share
    return time


def beyond_noise(value, variance, others):
    """The variance that windows show beyond their noise: of estimates (value, variance) from parts of the
    same rows, whose difference has the difference of the variances (Hausman, Econometrica 46 (1978) 1251)."""
    excess = [(v - value) ** 2 - max(s - variance, 0.0) for v, s in others]
    return max(float(np.mean(excess)), 0.0) if excess else 0.0


# ---- unloading ----


@dataclass
class Unloading:
    """Rows of one way back: from `start`, the last row at the largest depth, to `end`; `hold` is the first
    row at that depth (within hold_share of the way back), where the tool was held there, else `start`."""

    hold: int
    start: int
    end: int


def depth_noise(depth):
    """Standard deviation (m) of the scatter of single rows of depth about a smooth motion: by third
    differences, which a smooth motion hardly has, and their median, which jumps do not change."""
    depth = np.asarray(depth, dtype=float)
    if depth.size < 20:
        return 0.0
    return float(np.median(np.abs(np.diff(depth, 3)))) / (0.6745 * math.sqrt(20))


def find_unloadings(depth, load=None):
    """The ways back in a record of depth (m), one after the other, those longer than turn_share of the
    largest depth and than what its scatter does. With the load (N): where the scatter of the depth hides
    ways that long, the ways back are those of the load, by least_fall of its largest."""
    depth = np.asarray(depth, dtype=float)
    noise = depth_noise(depth)
    largest = max(float(np.max(depth, initial=0.0)), 0.0)
    if load is not None and noise_turn * noise > turn_share * largest:
        return _unloadings_of_load(depth, np.asarray(load, dtype=float), noise)
    found = _ways_back(depth, max(turn_share * largest, noise_turn * noise))
    return [Unloading(*_hold(depth, top, low, noise), low) for top, low in found if depth[top] > 0]


def _ways_back(values, least):
    """Pairs of rows (top, low) of the ways down in values that are longer than least."""
    found, top, low = [], 0, None
    for i in range(values.size):
        if low is None:
            if values[i] >= values[top]:
                top = i
            elif values[top] - values[i] > least:
                low = i
        elif values[i] < values[low]:
            low = i
        elif values[i] - values[low] > least:
            found.append((top, low))
            top, low = i, None
    if low is not None:
        found.append((top, low))
    return found


def _unloadings_of_load(depth, load, noise):
    """The ways back of the load. A hold is one of the depth, else one of the load."""
    load_noise = depth_noise(load)
    found = []
    for top, low in _ways_back(load, least_fall * float(np.max(load, initial=0.0))):
        if load[top] <= 0 or depth[top] <= 0:
            continue
        at_zero = np.flatnonzero(load[top : low + 1] <= 0)
        low = top + int(at_zero[0]) if at_zero.size else low
        first, last = _hold(depth, top, low, noise)
        if last == first:
            first, last = _hold(load, top, low, load_noise)
        found.append(Unloading(first, last, low))
    return found


def _hold(depth, top, low, noise):
    """First and last row at the largest depth; both `top` without a hold."""
    near = depth[top] - max(hold_share * (depth[top] - depth[low]), noise_band * noise)
    first = top
    while first > 0 and depth[first - 1] >= near:
        first -= 1
    last = top + int(np.flatnonzero(depth[top : low + 1] >= near)[-1])
    if last - first < 8:
        return top, top
    if depth[top] - near > hold_share * (depth[top] - depth[low]):  # a peak is as near as that too
        third = (last + 1 - first) // 3
        middle = np.median(depth[first + third : last + 1 - third])
        for end in (depth[first : first + third], depth[last + 1 - third : last + 1]):
            if middle - np.median(end) > noise_flat * noise:
                return top, top
        level = np.flatnonzero(depth[first : last + 1] >= middle - 2 * noise)
        first, last = first + int(level[0]), first + int(level[-1])
    return first, last


def end_of(values):
    """The last of some values, by a straight line where there are enough."""
    if values.size < hold_rows:
        return float(values.mean())
    return float(np.polyval(np.polyfit(np.arange(values.size), values, 1), values.size - 1))


@dataclass
class Fit:
    """P = a (h - h_f)^m of an unloading, by least squares. `values` are the load at the largest depth (N),
    h_f (m) and m, and `covariance` theirs, of noise; `scatter` (N) is that of single rows, `together` how
    many of them scatter as one, `rows` the slice of those fitted, `window` their shares of the load."""

    depth: float
    values: np.ndarray
    covariance: np.ndarray
    scatter: float
    together: float
    rows: slice
    window: tuple

    @property
    def residual_depth(self):
        return float(self.values[1])

    @property
    def exponent(self):
        return float(self.values[2])

    @property
    def factor(self):
        """a (N/m^m)."""
        return float(self.values[0] / (self.depth - self.values[1]) ** self.values[2])

    @property
    def stiffness(self):
        """dP/dh (N/m) at the largest depth."""
        return self.stiffness_of(*self.values)

    def stiffness_of(self, top, final, m):
        return m * top / (self.depth - final)

    @property
    def variance(self):
        """Of the stiffness, (N/m)^2, of noise."""
        return propagate(self.stiffness_of, self.values, self.covariance)[1] ** 2

    def load(self, depth):
        """Load (N) of the fit at depths (m)."""
        reach = np.maximum(np.asarray(depth) - self.values[1], 0.0) / (self.depth - self.values[1])
        return self.values[0] * reach ** self.values[2]


def fit_unloading(depth, load, shares=window, guess=None, top=None):
    """Fit P = a (h - h_f)^m to an unloading: rows from its start on, the load falling. `shares` are of the
    load of the first row, as the fit has it: rows are chosen by their depth, so that noise does not choose.
    `top` is the largest depth (m; that of the first row), `guess` a fit of other rows of this unloading to
    begin from. Raises NotEnough."""
    depth, load = np.asarray(depth, dtype=float), np.asarray(load, dtype=float)
    top = float(depth[0]) if top is None else top
    pressed = load.size if np.all(load > 0) else int(np.argmax(load <= 0))
    lowest = float(np.min(load)) / float(load[0]) if load[0] > 0 else 1.0
    if lowest > 1 - least_fall:
        raise NotEnough(
            f"the unloading ends at {100 * lowest:.3g} % of its load, and a fit needs one that goes down to "
            f"{100 * (1 - least_fall):g} %: draw the tool back further"
        )
    rows = _first_rows(load[:pressed], shares)
    for _ in range(3):
        fit = guess = _fit(depth, load, rows, top, shares, guess)
        falling = np.minimum.accumulate(fit.load(depth[:pressed]) / fit.values[0])
        chosen = np.flatnonzero((falling <= shares[1]) & (falling >= shares[0]))
        again = slice(int(chosen[0]), int(chosen[-1]) + 1) if chosen.size else slice(0, 0)
        if again == rows:
            break
        rows = again
    return fit


def _first_rows(load, shares):
    """Rows between the two shares, by a running mean of the load."""
    width = max(1, load.size // 40)
    smooth = np.convolve(load, np.ones(width) / width, mode="same") if width > 1 else load
    smooth[:width], smooth[-width:] = load[:width], load[-width:]
    top = float(np.mean(load[:width])) if load.size else 0.0
    below = np.flatnonzero(smooth <= shares[1] * top)
    if not below.size:
        return slice(0, 0)
    under = np.flatnonzero(smooth < shares[0] * top)
    return slice(int(below[0]), int(under[0]) if under.size else load.size)


def _fit(depth, load, rows, deepest, shares, guess=None):
    h, p = depth[rows], load[rows]
    if h.size < fewest_rows:
        raise NotEnough(
            f"the unloading has {h.size} rows between {100 * shares[0]:g} and {100 * shares[1]:g} % of its "
            "load, and a "
            f"fit needs {fewest_rows}: write more rows (history_every of &output; max_step of &quasi_static), "
            "or unload more slowly"
        )
    span = float(h[0] - h.min())
    if not span > 0:
        raise NotEnough("the depth does not fall over the unloading")
    unit = float(p[0])
    # In units of the load and the way back: the load at the largest depth, h_max - h_f, and m
    way = (deepest - h) / span
    nearest = float(way.max()) * (1 + 1e-9)

    def residual_of(x):
        return x[0] * np.maximum(1 - way / x[1], 1e-12) ** x[2] - p / unit

    def slopes(x):
        left = np.maximum(1 - way / x[1], 1e-12)
        power = left ** x[2]
        return np.stack(
            [power, x[0] * x[2] * power / left * way / x[1] ** 2, x[0] * power * np.log(left)], axis=1
        )

    firsts = [[1.0, 1.2 * nearest, m] for m in (1.2, 1.5, 2.0)]
    if guess is not None:
        firsts = [[guess.values[0] / unit, (deepest - guess.values[1]) / span, guess.values[2]]]
    low, high = np.array([0.1, nearest, 1.0]), np.array([10.0, 1e3, 20.0])
    best = None
    for first in firsts:
        found = least_squares(
            residual_of,
            np.clip(first, low * (1 + 1e-6), high * (1 - 1e-6)),
            jac=slopes,
            bounds=(low, high),
            ftol=1e-12,
            xtol=1e-12,
            gtol=1e-12,
            max_nfev=500,
        )
        if best is None or found.cost < best.cost:
            best = found
    residual = best.fun
    scatter = float(residual @ residual) / max(h.size - 3, 1)
    scale = np.sqrt((best.jac**2).sum(axis=0))
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv((best.jac / scale).T @ (best.jac / scale), hermitian=True) / np.outer(
        scale, scale
    )
    to_si = np.array([unit, -span, 1.0])
    together = correlation_time(residual)
    covariance = inverse * scatter * together * np.outer(to_si, to_si)
    values = np.array([best.x[0] * unit, deepest - best.x[1] * span, best.x[2]])
    return Fit(deepest, values, covariance, math.sqrt(scatter) * unit, together, rows, tuple(shares))


def load_at_start(depth, load, unloading, scatter, together=1.0):
    """The load (N) where an unloading begins, and its uncertainty: the mean of the second half of a hold,
    else where a parabola through the last twentieth of the loading ends, else that of the one row. `scatter`
    (N) is that of single rows, `together` how many of them scatter as one, in the unloading."""
    hold, start = unloading.hold, unloading.start
    if start - hold >= hold_rows:
        rows = load[hold + (start - hold) // 2 : start + 1]
        apart = float(np.std(rows, ddof=1))
        return float(np.mean(rows)), max(apart, scatter) * math.sqrt(
            max(correlation_time(rows - np.mean(rows)), together) / rows.size
        )
    first = start
    while first > 0 and depth[first - 1] >= 0.95 * depth[start] and depth[first - 1] <= depth[first]:
        first -= 1
    count = start - first + 1
    if count < 8:
        return float(load[start]), scatter
    x = (depth[first : start + 1] - depth[start]) / (depth[start] - depth[first])
    base = np.stack([np.ones(count), x, x**2], axis=1)
    found, *_ = np.linalg.lstsq(base, load[first : start + 1], rcond=None)
    residual = load[first : start + 1] - base @ found
    apart = float(residual @ residual) / (count - 3) * max(correlation_time(residual), together)
    return float(found[0]), math.sqrt(apart * np.linalg.inv(base.T @ base)[0, 0])


@dataclass
class Result:
    """What one unloading gives (SI); `sigma` has the uncertainty of each value by the same name."""

    values: dict
    sigma: dict
    fit: Fit
    parts: dict


def analyse_unloading(
    depth,
    load,
    unloading,
    area_function=None,
    beta=1.0,
    epsilon=None,
    shares=window,
    area_true=None,
    poisson=None,
):
    """Oliver and Pharr's analysis of one unloading of a record, and the same with a measured area.

    area_function(contact depth) gives the projected area (m2), None where there is none; epsilon is a number,
    or None for that of the exponent; area_true is (m2, its uncertainty) or None. Raises NotEnough."""
    depth, load = np.asarray(depth, dtype=float), np.asarray(load, dtype=float)
    h, p = depth[unloading.start : unloading.end + 1], load[unloading.start : unloading.end + 1]
    held = depth[unloading.hold : unloading.start + 1]
    noise = depth_noise(depth)
    noisy = noise_band * noise > hold_share * (held.max() - depth[unloading.end])
    top_depth = end_of(held[held.size // 2 :]) if noisy else float(held.max())
    fit = fit_unloading(h, p, shares, top=top_depth)
    others = []
    for low, high in other_windows:
        if (low >= shares[0] and high < shares[1]) or (low > shares[0] and high <= shares[1]):
            try:
                others.append(fit_unloading(h, p, (low, high), fit, top_depth))
            except NotEnough:
                continue
    systematic = {
        name: beyond_noise(of(fit), spread(fit), [(of(o), spread(o)) for o in others])
        for name, of, spread in (
            ("stiffness", lambda f: f.stiffness, lambda f: f.variance),
            ("residual_depth", lambda f: f.values[1], lambda f: f.covariance[1, 1]),
            ("exponent", lambda f: f.values[2], lambda f: f.covariance[2, 2]),
        )
    }
    top_load, top_sigma = load_at_start(depth, load, unloading, fit.scatter, fit.together)
    step = abs(float(depth[unloading.start] - depth[min(unloading.start + 1, depth.size - 1)]))
    depth_sigma = 0.0 if held.size > 1 else step / 2  # where it turned is between two rows
    if noisy:  # the deepest of many rows is so by its scatter
        depth_sigma = max(depth_sigma, 3 * noise if held.size == 1 else noise)

    # of stiffness, exponent, load, depth: what the rest follows from
    jacobian = np.zeros((2, 3))
    slopes = fit.stiffness / np.array([fit.values[0], fit.depth - fit.values[1], fit.values[2]])
    jacobian[0] = slopes
    jacobian[1, 2] = 1.0
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = jacobian @ fit.covariance @ jacobian.T + np.diag(
        [systematic["stiffness"], systematic["exponent"]]
    )
    covariance[2, 2], covariance[3, 3] = top_sigma**2, depth_sigma**2
    basis = (fit.stiffness, fit.exponent, top_load, top_depth)

    def factor(m):
        return epsilon_of_exponent(max(m, 1.0)) if epsilon is None else epsilon

    values = {"max_depth": top_depth, "max_load": top_load, "unloading_factor": fit.factor}
    sigma = {"max_depth": depth_sigma, "max_load": top_sigma}

    def derive(name, function):
        values[name], sigma[name] = propagate(function, basis, covariance)

    derive("stiffness", lambda s, m, p, h: s)
    derive("unloading_exponent", lambda s, m, p, h: m)
    derive("epsilon", lambda s, m, p, h: factor(m))
    values["residual_depth"] = fit.residual_depth
    sigma["residual_depth"] = math.sqrt(fit.covariance[1, 1] + systematic["residual_depth"])
    values["residual_depth_ratio"] = fit.residual_depth / top_depth
    sigma["residual_depth_ratio"] = (
        math.hypot(sigma["residual_depth"], values["residual_depth_ratio"] * depth_sigma) / top_depth
    )
    derive("contact_depth", lambda s, m, p, h: contact_depth(h, p, s, factor(m)))
    values["beta"] = beta
    if area_function is not None and values["contact_depth"] > 0:

        def area(s, m, p, h):
            return max(area_function(contact_depth(h, p, s, factor(m))), 1e-300)

        derive("area_oliver_pharr", area)
        derive("hardness_oliver_pharr", lambda s, m, p, h: p / area(s, m, p, h))
        derive("modulus_oliver_pharr", lambda s, m, p, h: reduced_modulus(s, area(s, m, p, h), beta))
    if area_true is not None:
        true, true_sigma = area_true
        wide = np.zeros((5, 5))
        wide[:4, :4] = covariance
        wide[4, 4] = true_sigma**2
        values["modulus_true"], sigma["modulus_true"] = propagate(
            lambda s, m, p, h, a: reduced_modulus(s, a, beta), basis + (true,), wide
        )
    for kind in ("oliver_pharr", "true"):
        if poisson is not None and f"modulus_{kind}" in values:
            for numbers in (values, sigma):
                numbers[f"young_{kind}"] = numbers[f"modulus_{kind}"] * (1 - poisson**2)
    parts = {
        "stiffness_noise": math.sqrt(fit.variance),
        "stiffness_window": math.sqrt(systematic["stiffness"]),
        "load_scatter": fit.scatter,
    }
    return Result(values, sigma, fit, parts)


# ---- loading and work ----


def virgin_rows(depth, until, swing=0.0):
    """Rows up to `until` in which the depth is larger than ever before, and above 0. Where depths scatter, or
    swing by so much (m), larger but for that: the rows that are so by their scatter would be too deep."""
    deepest = np.r_[-np.inf, np.maximum.accumulate(depth[:until])]
    scatter = max(noise_band * depth_noise(depth), swing)
    if scatter > hold_share * np.max(depth, initial=0.0):
        deepest -= scatter
    return np.flatnonzero((depth[: until + 1] > deepest) & (depth[: until + 1] > 0))


def loading_curvature(depth, load, until, shares=loading_window):
    """C (Pa) of P = C h^2 over the stated shares of the depth, its uncertainty, and the exponent of the
    loading with its own: 2 for cones and pyramids, where C says all. Raises NotEnough."""
    rows = virgin_rows(np.asarray(depth), until)
    h, p = np.asarray(depth)[rows], np.asarray(load)[rows]
    if h.size == 0:
        raise NotEnough("the tool does not go in")

    def fit(low, high):
        x, y = h[(h >= low * h[-1]) & (h <= high * h[-1])], p[(h >= low * h[-1]) & (h <= high * h[-1])]
        if x.size < 5:
            return None
        value = float((x**2 @ y) / np.sum(x**4))
        residual = y - value * x**2
        return (
            value,
            float(residual @ residual) / (x.size - 1) * correlation_time(residual) / float(np.sum(x**4)),
            x,
            y,
        )

    main = fit(*shares)
    if main is None:
        raise NotEnough(
            f"the loading has fewer than 5 rows between {100 * shares[0]:g} and {100 * shares[1]:g} % of its "
            "depth"
        )
    value, variance, x, y = main
    others = [(o[0], o[1]) for o in (fit(*other) for other in other_loading_windows) if o is not None]
    sigma = math.sqrt(variance + beyond_noise(value, variance, others))
    if np.any(y <= 0):
        return value, sigma, None, None
    base = np.stack([np.ones(x.size), np.log(x)], axis=1)
    found, *_ = np.linalg.lstsq(base, np.log(y), rcond=None)
    residual = np.log(y) - base @ found
    spread = (
        float(residual @ residual)
        / (x.size - 2)
        * correlation_time(residual)
        * np.linalg.inv(base.T @ base)[1, 1]
    )
    return value, sigma, float(found[1]), math.sqrt(spread)


def work(depth, load, unloading, fit):
    """Work (J) done up to the start of an unloading, work given back by it, and the plastic share 1 -
    back/done: values and uncertainties. An unloading that ends while the load is above 0 is carried on by the
    fit down to h_f; how far that is from a straight line with the fit's last slope counts as uncertainty."""
    depth, load = np.asarray(depth, dtype=float), np.asarray(load, dtype=float)
    going = slice(0, unloading.start + 1)
    done = float(trapezoid(load[going], depth[going]))
    back_rows = slice(unloading.start, unloading.end + 1)
    h, p = depth[back_rows], load[back_rows]
    pressed = p > 0
    end = int(np.argmin(pressed)) if not np.all(pressed) else p.size
    back = -float(trapezoid(p[:end], h[:end]))
    left, left_sigma = 0.0, 0.0
    if end == p.size and h[-1] > fit.residual_depth:
        reach = float(h[-1] - fit.residual_depth)
        left = float(fit.load(h[-1])) * reach / (fit.exponent + 1)
        slope = fit.exponent * float(fit.load(h[-1])) / reach
        left_sigma = abs(left - float(fit.load(h[-1])) ** 2 / (2 * slope))
    back += left
    steps_in, steps_back = np.diff(depth[going]), np.diff(h[:end])
    done_sigma = fit.scatter * math.sqrt(float(steps_in @ steps_in))
    back_sigma = math.hypot(fit.scatter * math.sqrt(float(steps_back @ steps_back)), left_sigma)
    share = 1 - back / done if done > 0 else float("nan")
    share_sigma = math.hypot(back_sigma / done, back * done_sigma / done**2) if done > 0 else float("nan")
    return {"work_total": done, "work_elastic": back, "work_ratio": share}, {
        "work_total": done_sigma,
        "work_elastic": back_sigma,
        "work_ratio": share_sigma,
    }
