"""The forward model: the axisymmetric scene of a tip in a hardening metal, and what is kept of its run.

Under a sharp cone load over depth squared and the unloading over the largest depth depend on E/sigma_y, the
exponent and Poisson's ratio alone, so that a scene has one modulus, one density and one depth, and serves
every experiment. Rounded tips and spheres have the depth over the radius besides.

The load of a tool that stops falls by some per cent before the unloading (doc/notebook/load_at_a_stop.md).
The load in motion is the right one. The fall scatters by 1 % from run to run, and the recovered depth does
not follow it: the recovery is that of the load in motion, at the same share of the load at rest.

Runs have a finite speed, so that waves carry energy away from the contact. A half-space responds to an
elastic displacement of the contact like a spring with a parallel dashpot of 3.4 r^2 sqrt(rho G)/(1 - nu) (a
rigid disc of radius r at low frequency, Lysmer and Richart 1966); r follows from the stiffness, S = 2 E* r.
The force of the dashpot is added to the loads of the unloading, and the depths of the loading are increased
by the lag of the elastic displacement."""

import math
from dataclasses import asdict, dataclass, replace

import numpy as np

from .laws import KNOWN, POWER
from .tips import Tip

YOUNG, DENSITY, DEPTH = 1e11, 1e4, 1e-6  # of every scene: Pa, kg/m3, m
REPRESENTATIVE = 0.033  # plastic strain, that of a cone of 70.3 degrees (Dao et al. 2001)
SLOWEST = 0.0014  # lowest speed of the tool over that of pressure waves
BINS = 60  # of the loading, and of the unloading, that are kept
LOADING = (0.45, 1.0)  # shares of the depth that C is taken from
UNLOADING = (0.05, 0.95)  # shares of the load that the unloading is taken from
BENT = (0.3, 1.0)  # shares of the depth that the loading of a tip with a length is taken from
PILE_UP = np.linspace(0.75, 1.3, 56)  # radius of contact over that of the ideal section
SWEEPS = 8  # of the force of the dashpot and the stiffness
LAGS = 3  # sweeps of the lag and the slope of the loading
DASHPOT = 3.4  # of a rigid disc on a half-space, over r^2 sqrt(rho G)/(1 - nu)
BLUNT = math.tan(math.radians(70.3))  # contact radius over depth that cells are laid out for


@dataclass(frozen=True)
class Numerics:
    """cells: finest cells to the largest depth of a cone of 70.3 degrees, as many to the contact radius of
    other cones; fine: number of finest cells across the finest level; levels: number of coarser levels, each
    with cells twice as wide; speed: speed of the tool over the flow stress over rho c; back: depth over the
    way of a pressure wave during the unloading; fastest: largest speed of the tool over that of pressure
    waves."""

    cells: float = 3.5
    fine: int = 14
    levels: int = 5
    speed: float = 0.7
    back: float = 0.003
    flip: float = 0.97
    fastest: float = 0.002


@dataclass(frozen=True)
class Case:
    """A scene: a tip (its lengths over the largest depth), the material, the numerics."""

    tip: Tip
    ratio: float  # E over yield stress; of an elastic law 1
    shape: tuple  # coordinates of the law (laws.py)
    poisson: float = 0.3
    numerics: Numerics = Numerics()
    law: str = "power"

    @property
    def flow_ratio(self):
        """E over the stress at the representative strain."""
        return self.ratio / float(KNOWN[self.law].stress(self.ratio, 1.0, self.shape, REPRESENTATIVE))

    @property
    def width(self):
        """Cells are laid out for this contact radius at the largest depth, over that of a cone of 70.3
        degrees, or of a sharp one."""
        tip = self.tip
        if not tip.has_length:
            return float(f"{math.tan(math.radians(tip.half_angle)) / BLUNT:.4g}")
        sharp = math.tan(math.radians(tip.half_angle)) if tip.kind == "cone" else BLUNT
        return float(f"{tip.contact_radius(1.0) / sharp:.4g}")

    def with_numerics(self, **changes):
        return replace(self, numerics=replace(self.numerics, **changes))

    def record(self):
        return asdict(self)


def case_of(record):
    """The Case of a record (Case.record)."""
    tip = {**record["tip"], "profile": tuple(map(tuple, record["tip"].get("profile", ())))}
    return Case(
        Tip(**tip),
        record["ratio"],
        tuple(record["shape"]),
        record["poisson"],
        Numerics(**{"fastest": 0.006, **record["numerics"]}),  # what records without it have
        record.get("law", "power"),
    )


def recovery(case):
    """What comes back over the depth, about: how far the tool has to be drawn back."""
    tip = case.tip
    if not tip.has_length:
        slope = math.tan(math.radians(tip.half_angle)) / BLUNT
        return min(0.62, 14.0 / case.flow_ratio**0.97 / slope + 0.02)
    return min(0.85, 18.0 * tip.contact_radius(1.0) / BLUNT / case.flow_ratio**0.97 + 0.02)


def motion(case):
    """Times (s), speeds (m/s) of the tool and the end of the scene."""
    c = np.sqrt(YOUNG * (1 - case.poisson) / (1 + case.poisson) / (1 - 2 * case.poisson) / DENSITY)
    numerics = case.numerics
    share = numerics.speed / Numerics.speed
    pace = c / (1.0 if case.tip.has_length else case.width)  # waves cross the contact in a time of its radius
    speed = min(max(numerics.speed / case.flow_ratio, SLOWEST * share), numerics.fastest * share) * pace
    way = 1.25 * recovery(case) * DEPTH
    back = numerics.back * 1.25 * recovery(case) * pace
    unit = DEPTH / speed
    times = np.cumsum([0.0, 0.05 * unit, 0.9 * unit, 0.15 * unit, 0.05 * unit, 0.1 * way / back])
    return times, [0.0, speed, speed, 0.0, 0.0, -back], float(times[-1] + way / back)


def listed(values):
    return ",".join(f"{value:.9g}" for value in values)


def named(case):
    """Its material, for the title."""
    if case.law == "power":
        return f"E/Y={case.ratio:.6g}, n={case.shape[0]:.6g}"
    return f"{case.law}, E/Y={case.ratio:.6g}, " + " ".join(f"{value:.6g}" for value in case.shape)


def scene_text(case, directory="out"):
    """The scene of a case."""
    numerics, poisson, law = case.numerics, case.poisson, KNOWN[case.law]
    finest = DEPTH * case.width / numerics.cells
    coarse = finest * 2**numerics.levels
    size = numerics.fine * coarse
    outer = size + 4 * coarse
    boxes = []
    for level in range(numerics.levels):
        cell = finest * 2 ** (numerics.levels - 1 - level)
        span = numerics.fine * cell
        boxes.append(
            f"&level    lower=0,0,{size - span:.12g}, "
            f"upper={span:.12g},{coarse:.12g},{size + 4 * cell:.12g} /"
        )
    times, speeds, end = motion(case)
    lines = [
        f"&scene    title='{case.tip.kind}, {named(case)}', end_time={end:.9g} /",
        f"&grid     geometry='axisymmetric', lower=0,0,0, upper={outer:.12g},{coarse:.12g},{outer:.12g},",
        f"          cell_size={coarse:.12g}, "
        "boundary='symmetry','free','symmetry','symmetry','roller','free' /",
        f"&time     flip_fraction={numerics.flip:g} /",
        *boxes,
        f"&material name='metal', model='{'j2' if law.flows else 'elastic'}', density={DENSITY:g}, "
        f"young={YOUNG:g}, poisson={poisson:g}" + ("," if law.flows else " /"),
        *([f"          {law.material_words(YOUNG, YOUNG / case.ratio, case.shape)} /"] if law.flows else []),
        "&body     material='metal', shape='box', lower=0,0,0, "
        f"upper={size:.12g},{coarse:.12g},{size:.12g} /",
        f"&tool     name='tip', {case.tip.scene_words(DEPTH)}, tip=0,0,{size:.12g},",
        f"          times={listed(times)}, speeds={listed(speeds)} /",
        f"&output   directory='{directory}', fields='none', history_every={end / 600:.9g} /",
    ]
    return "\n".join(lines) + "\n"


def binned(x, y, edges):
    """Means of y over x within the edges (m), where there are rows."""
    number = np.digitize(x, edges) - 1
    inside = (number >= 0) & (number < len(edges) - 1)
    count = np.bincount(number[inside], minlength=len(edges) - 1)
    sums = [np.bincount(number[inside], weights=v[inside], minlength=len(edges) - 1) for v in (x, y)]
    some = count > 0
    return sums[0][some] / count[some], sums[1][some] / count[some]


def reduced(depth, load, time, case):
    """What is kept of a run, over E h^2 and the largest depth: rows of the loading, the load at rest, rows of
    the unloading. Depths in m, loads of the full body in N."""
    times, _, _ = motion(case)
    top = float(np.max(depth))
    h, p = np.asarray(depth) / top, np.asarray(load) / (YOUNG * top**2)
    moving, back = np.asarray(time) <= times[3], np.asarray(time) > times[4]
    resting = (np.asarray(time) > 0.5 * (times[3] + times[4])) & ~back
    going_back = np.flatnonzero(back)
    loose = np.flatnonzero(p[back] <= 0)
    going_back = going_back[: loose[0]] if loose.size else going_back
    at_rest = float(np.mean(p[resting])) if np.any(resting) else float(p[going_back[0]])
    h_in, p_in = binned(h[moving], p[moving], np.linspace(0, 1 + 1e-9, BINS + 1))
    least = h[going_back].min() if going_back.size else 1.0
    h_out, p_out = binned(h[going_back], p[going_back], np.linspace(least, 1 + 1e-9, BINS + 1))
    digits = lambda values: [float(f"{value:.6g}") for value in values]
    return {
        "loading_depth": digits(h_in),
        "loading_load": digits(p_in),
        "load_at_rest": float(f"{at_rest:.6g}"),
        "unloading_depth": digits(h_out),
        "unloading_load": digits(p_out),
    }


def curvature(kept, low=LOADING[0], high=LOADING[1]):
    """C over E, from the work between two shares of the depth."""
    h, p = np.array(kept["loading_depth"]), np.array(kept["loading_load"])
    rows = (h >= low) & (h <= high)
    h, p = h[rows], p[rows]
    return float(p @ np.ones(p.size) / (h**2 @ np.ones(h.size)))


def loading_law(kept, case):
    """ln C, q1, q2 of P/(E h^2) = C (h/h_max)^(q1 - 2) exp(q2 ln^2(h/h_max)): the loading of a tip that has
    a length, without the effect of waves; rows count by their load. Each depth is increased by its lag, which
    goes by the slope of the law that is found."""
    h, p = np.array(kept["loading_depth"]), np.array(kept["loading_load"])
    rows = (h >= BENT[0]) & (h <= BENT[1]) & (p > 0)
    h, p = h[rows], p[rows]
    speed, static = speeds_in(case, h), h
    for _ in range(LAGS):
        way = np.log(static)
        rows = np.stack([np.ones_like(way), way, way**2], axis=-1) * p[:, None]
        first, second, third = np.linalg.lstsq(rows, np.log(p) * p, rcond=None)[0]
        way = np.log(h)
        slope = np.exp(first + second * way + third * way**2) * (second + 2 * third * way) / h
        static = h + lag(case, speed, slope)
    return smooth_loading(case, h, p, static)


def smooth_loading(case, h, p, static):
    """The numbers of loading_law, where the loads p belong to the depths `static`. The load of a contact
    rises and falls as its edge goes from cell to cell: a wave with the radius of contact in cells, that of
    the ideal section times a factor (pile-up) which is found, is taken out."""
    x, weight = np.log(static), p
    cells = np.array([case.tip.contact_radius(one) for one in h]) * case.numerics.cells / case.width
    smooth = np.stack([np.ones_like(x), x, x**2], axis=-1)
    best, found = np.inf, None
    for factor in PILE_UP:
        wave = np.stack([turn(2 * np.pi * factor * cells) / cells for turn in (np.cos, np.sin)], axis=-1)
        columns = np.concatenate([smooth, wave], axis=-1) * weight[:, None]
        numbers = np.linalg.lstsq(columns, np.log(p) * weight, rcond=None)[0]
        left = float(np.sum((columns @ numbers - np.log(p) * weight) ** 2))
        if left < best:
            best, found = left, numbers[:3]
    return found


def radiated(case, speed, stiffness):
    """Force of the dashpot over E h^2 at a speed (m/s) of the elastic displacement; stiffness over E h."""
    poisson = case.poisson
    radius = 0.5 * stiffness * (1 - poisson**2)
    return DASHPOT * radius**2 / (1 - poisson) * speed * np.sqrt(DENSITY / (2 * (1 + poisson) * YOUNG))


def lag(case, speed, slope):
    """Depth over the largest by which the elastic displacement lags: c P'/S^2, c of the dashpot, at a load
    that rises by `slope` (over E h^2 and the largest depth) with a tool of a speed (m/s). c goes by the
    square of the stiffness, so that the lag does not depend on it."""
    return radiated(case, speed, 1.0) * slope


def speeds_in(case, depth):
    """Speed of the tool (m/s) at shares of the largest depth: its speed changes evenly at both ends."""
    times, speeds, _ = motion(case)
    speed = speeds[1]
    first, last = (0.5 * speed * (times[k + 1] - times[k]) / DEPTH for k in (0, 2))
    return speed * np.sqrt(np.clip(np.minimum(depth / first, (1 - depth) / last), 0.0, 1.0))


def speeds_back(case, back):
    """Speed of the tool (m/s) where it has come back by shares of the depth: it is accelerated evenly."""
    times, speeds, _ = motion(case)
    speed = -speeds[-1]
    way = 0.5 * speed * (times[5] - times[4]) / DEPTH
    return speed * np.sqrt(np.clip(back / way, 0.0, 1.0))


def unloading_law(kept, case):
    """delta0 and 1/m of delta(s) = delta0 (1 - s^(1/m)): the recovery over the largest depth at a share s of
    the largest load. The force of the dashpot follows from the stiffness, which falls with s as the contact
    does."""
    from scipy.optimize import minimize_scalar

    h, p, rest = np.array(kept["unloading_depth"]), np.array(kept["unloading_load"]), kept["load_at_rest"]
    every, speed = 1 - h, speeds_back(case, 1 - h)
    size, inverse, share = np.inf, 1.0, p / rest
    for _ in range(SWEEPS):
        stiffness = rest / (size * inverse) * np.clip(share, 1e-3, 1.0) ** (1 - inverse)
        share = p / rest + radiated(case, speed, stiffness) / rest
        rows = (share > UNLOADING[0]) & (share < UNLOADING[1])
        back, some = every[rows], share[rows]

        def fitted(inverse, back=back, some=some):
            rise = 1 - some**inverse
            size = float(rise @ back / (rise @ rise))
            return size, float(np.sum((size * rise - back) ** 2))

        found = minimize_scalar(
            lambda x: fitted(x)[1], bounds=(0.3, 1.0), method="bounded", options={"xatol": 1e-7}
        )
        inverse = float(found.x)
        size = min(max(fitted(inverse)[0], 1e-4), 1.5)
    return size, inverse


def sharp_law(kept, case):
    """ln of the load over E h^2, delta0 and 1/m under a sharp tip, without the effect of waves."""
    rest, (size, inverse) = kept["load_at_rest"], unloading_law(kept, case)
    late = lag(case, motion(case)[1][1], 2 * rest)
    return math.log(curvature(kept) * (1 - late) ** 2), size, inverse


def mean_recovery(recovered, inverse):
    """The mean of delta over the shares of the load: work that comes back over load times depth."""
    return recovered * inverse / (1 + inverse)


def full_recovery(mean, inverse):
    """delta0 of that mean."""
    return mean * (1 + inverse) / inverse
