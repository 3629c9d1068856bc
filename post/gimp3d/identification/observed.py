"""What the curves under one tip say, as few numbers with their covariance: C, the work that comes back over
load times depth (the mean recovery), the power of the unloading; of a tip that has a length also the power of
the loading and how it changes, about the depth of the tip's runs. Zero of the depth, compliance of the frame
and drift may be free; they widen the covariance."""

from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from .. import oliver_pharr
from . import forward, measured

LOADING = (0.3, 1.0)  # shares of the depth that are fitted
UNLOADING = (0.05, 0.95)  # shares of the load
FREE = ("zero", "compliance", "drift")
WIDTHS = {"zero": 0.05, "compliance": 0.5, "drift": 0.05}  # of the steps in them: shares of the depth
DRIFT = 0.02  # one sigma of what a drift may add to the depth, as a share
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
    load: float
    time: float
    load_sigma: float  # one sigma of `load`, as a share
    begin: float  # time at which the depth begins


def segments(curve):
    depth, load = curve.depth, curve.load
    time = curve.time if curve.time is not None else np.arange(len(depth), dtype=float)
    ways = oliver_pharr.find_unloadings(depth)
    if not ways:
        raise NoUnloading(f"{curve.name}: the curve has no unloading")
    way = max(ways, key=lambda one: depth[one.start])
    top, top_sigma = oliver_pharr.load_at_start(depth, load, way, 0.0)
    rows = oliver_pharr.virgin_rows(depth, way.hold)
    begin = float(time[rows[0]]) if len(rows) else 0.0
    rows = rows[(depth[rows] >= LOADING[0] * depth[way.start])]
    back = np.arange(way.start, way.end + 1)
    share = load[back] / top
    gone = np.flatnonzero(share < UNLOADING[0])
    back = back[: gone[0]] if gone.size else back
    back = back[load[back] / top < UNLOADING[1]]
    if len(rows) < 8 or len(back) < 8:
        raise NoUnloading(
            f"{curve.name}: {len(rows)} rows of loading, {len(back)} of unloading; at least 8 of each are "
            "required"
        )
    return Segments(
        curve.name, depth[rows], load[rows], time[rows], depth[back], load[back], time[back],
        float(depth[way.start]), float(top), float(time[way.start]), float(top_sigma / top) + 1e-5,
        begin,
    )  # fmt: skip


def scatter_of(residual, scale):
    """One sigma of a row over the largest load, larger where neighbours scatter together."""
    together = oliver_pharr.correlation_time(residual - residual.mean())
    return max(scale * float(np.sqrt(np.mean(residual**2) * together)), 1e-5)


def depth_of(curve):
    """The largest, m."""
    return float(np.max(curve.depth))


def from_curves(tip, curves, free=(), noise=None):
    """Observed of the curves under one tip, of about one depth where it has a length. `free`: some of FREE;
    `noise`: one sigma of the load over the largest, else found from the rows."""
    parts = [segments(curve) for curve in curves]
    deepest = max(part.top for part in parts)
    bent = tip.has_length
    reference = tip.model(deepest)[1]  # of the runs
    size = 5 if bent else 3
    count = {name: 1 if name == "compliance" else len(parts) for name in free}
    tops, at = slice(size, size + len(parts)), size + len(parts)  # ln of the load where each way back begins
    places = {}
    for name in free:
        places[name] = np.arange(at, at + count[name])
        at += count[name]
    stiff = np.mean([part.load / part.top for part in parts])

    def span_of(part):
        return max(part.t_out[-1] - part.begin, 1e-300)

    def compliance_of(x):
        if "compliance" not in places:
            return 0.0
        return x[places["compliance"][0]] * WIDTHS["compliance"] / stiff * 0.1

    def corrected(x, number, part, h, p, t):
        found = h - compliance_of(x) * p
        if "zero" in places:
            found -= x[places["zero"][number]] * deepest * WIDTHS["zero"]
        if "drift" in places:
            found -= x[places["drift"][number]] * WIDTHS["drift"] * deepest * (t - part.begin) / span_of(part)
        return found

    def loading(x, h):
        """The load that a depth has on the way in, and its slope."""
        load, h = np.exp(x[0]) * np.maximum(h, 0) ** 2, np.maximum(h, 1e-3 * reference)
        if not bent:
            return load, 2 * load / h
        way = np.log(h / reference)
        load *= np.exp((x[3] - 2) * way + x[4] * way**2)
        return load, (x[3] + 2 * x[4] * way) * load / h

    def residuals(x, scales):
        found = []
        for number, part in enumerate(parts):
            scale_in, scale_out = scales[number]
            h_in = corrected(x, number, part, part.h_in, part.p_in, part.t_in)
            load, rise = loading(x, h_in)
            # loads scatter, and depths that are corrected by them: each row is off by its own load alone
            found.append((part.p_in - load) / (1 + compliance_of(x) * rise) / (scale_in * part.load))
            top = corrected(
                x, number, part, np.array([part.top]), np.array([part.load]), np.array([part.time])
            )
            h_out = corrected(x, number, part, part.h_out, part.p_out, part.t_out)
            begin = part.load * np.exp(x[tops][number] * part.load_sigma)
            share = np.clip(part.p_out / begin, 1e-6, 1)
            fallen = begin / max(loading(x, top)[0][0], 1e-300)  # of a hold at a given depth
            recovered, inverse = forward.full_recovery(np.exp(x[1]), x[2]) * fallen, x[2]
            slope = recovered * inverse * share ** (inverse - 1)
            back = 1 - h_out / top[0]
            slope += compliance_of(x) * begin / top[0]
            found.append((back - recovered * (1 - share**inverse)) / (scale_out * slope))
        return found

    def everything(x, scales):
        expected = [x[places["drift"]] * WIDTHS["drift"] / DRIFT] if "drift" in places else []
        return np.concatenate([*residuals(x, scales), x[tops], *expected])

    def solve(x, scales):
        low, high = np.full(at, -np.inf), np.full(at, np.inf)
        low[2], high[2] = 0.3, 1.0
        if "compliance" in places:
            low[places["compliance"]] = 0
        return least_squares(
            lambda x: everything(x, scales), x, bounds=(low, high), x_scale=0.1, method="trf"
        )

    first = parts[0]
    start = np.zeros(at)
    back = float(np.max(1 - first.h_out / first.top))
    start[:3] = np.log(first.load / first.top**2), np.log(max(0.4 * back, 1e-3)), 0.7
    if bent:
        start[3] = 1.5
    if "compliance" in places:
        start[places["compliance"]] = 0.02
    scales = [(noise or 0.01, noise or 0.01)] * len(parts)
    for _ in range(3):  # the scatter of the rows, and how many of them scatter as one
        found = solve(start, scales)
        left, start = residuals(found.x, scales), found.x
        scales = [
            tuple(scatter_of(left[2 * number + k], scales[number][k]) for k in range(2))
            for number in range(len(parts))
        ]
    found = solve(start, scales)
    scale = np.sqrt((found.jac**2).sum(axis=0)) + 1e-300
    covariance = np.linalg.pinv((found.jac / scale).T @ (found.jac / scale), rcond=1e-12) / np.outer(
        scale, scale
    )
    corrections = {}
    for name, place in places.items():
        unit = {
            "zero": deepest * WIDTHS["zero"],
            "compliance": WIDTHS["compliance"] * 0.1 / stiff,
            "drift": WIDTHS["drift"] * deepest / span_of(first),
        }[name]
        corrections[name] = [
            (float(found.x[i] * unit), float(np.sqrt(covariance[i, i]) * unit)) for i in place
        ]
    return Observed(
        tip, ["ln C", "ln recovery", "1/m", "power", "change of the power"][:size], found.x[:size],
        covariance[:size, :size], lambda f: f,
        [part.name for part in parts], corrections,
        [(curve.name, curve.depth, curve.load, None) for curve in curves],
        float(np.mean([pair[0] for pair in scales])), deepest,
    )  # fmt: skip


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
