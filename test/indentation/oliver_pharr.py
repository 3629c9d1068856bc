"""post/gimp3d/oliver_pharr.py with published numbers and made-up curves. usage: oliver_pharr.py ROOT"""

import math
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(sys.argv[1])
from gimp3d import oliver_pharr as op
from checks import check, finish, near, require


def refused(word, action):
    """Whether an analysis is refused with a sentence that has this word."""
    try:
        action()
    except op.NotEnough as error:
        return word in str(error)
    return False


# ---- an instrument's numbers (test/references/oliver_pharr.toml) ----

for name, case in tomllib.loads((ROOT / "test/references/oliver_pharr.toml").read_text()).items():
    area = op.fitted_area(case["coefficients"])(
        op.contact_depth(case["depth"], case["load"], case["stiffness"], 0.75)
    )
    reduced = op.reduced_modulus(case["stiffness"], area)
    found = {
        "hardness": case["load"] / area,
        "young": op.young_modulus(reduced, case["poisson"], 1141e9, 0.07),
        "reduced": reduced,
        "area": area,
        "stiffness_squared_over_load": case["stiffness"] ** 2 / case["load"],
    }
    for quantity, value in found.items():
        if quantity in case:
            digits = -math.log10(abs(value / case[quantity] - 1) + 1e-16)
            print(
                f"   {name} {quantity}: {value:.9e}, the instrument {case[quantity]:.9e}, {digits:.1f} digits"
            )
            require(f"{name}: {quantity} to the digits", near(value, case[quantity], 2e-6))
    wrong = op.contact_depth(case["depth"], case["load"], case["stiffness"], 0.72)
    require(
        f"{name}: another epsilon is not met",
        not near(case["load"] / op.fitted_area(case["coefficients"])(wrong), case["hardness"], 1e-3),
    )

# ---- formulas ----

require(
    "epsilon: flat, paraboloid, cone",
    near(op.epsilon_of_exponent(1.0), 1)
    and near(op.epsilon_of_exponent(1.5), 0.75)
    and near(op.epsilon_of_exponent(2.0), 2 - 4 / math.pi),
)
require("epsilon is continuous at m = 1", abs(op.epsilon_of_exponent(1 + 2e-6) - 1) < 2e-3)
require("Hay's factor: 1.067 at 70.3 degrees and 0.3", abs(op.hay_factor(70.3, 0.3) - 1.067) < 5e-4)
require(
    "Hay's factor: 1 where nothing moves sideways",
    op.hay_factor(45, 0.5) == 1 and near(op.hay_factor(70.3, 0.5), 1),
)
require(
    "Hay's factor: both forms agree within 3 % at 60 degrees",
    abs(op.hay_factor(60, 0.3) / op.hay_factor(60.001, 0.3) - 1) < 0.03,
)
require(
    "ideal areas: 24.5 h^2 of the 70.3 degree cone, Berkovich and Vickers",
    all(
        abs(op.ideal_area(shape, half_angle=angle, faces=faces)(1e-7) * 1e14 - 24.5) < 0.07
        for shape, angle, faces in (("cone", 70.3, None), ("berkovich", 65.27, None), ("pyramid", 68, 4))
    ),
)
require(
    "ideal areas: a pyramid of 3 faces is a Berkovich",
    near(op.ideal_area("pyramid", 65.27, faces=3)(1e-7), op.ideal_area("berkovich", 65.27)(1e-7)),
)
require(
    "ideal areas: sphere, also beyond its radius; flat",
    near(op.ideal_area("sphere", radius=2.0)(0.5), math.pi * 1.75)
    and near(op.ideal_area("sphere", radius=2.0)(3.0), 4 * math.pi)
    and near(op.ideal_area("flat", radius=2.0)(0.1), 4 * math.pi),
)
rounded, sharp = (
    op.ideal_area("cone", half_angle=70.3, tip_radius=1e-7),
    op.ideal_area("cone", half_angle=70.3),
)
touch = 1e-7 * (1 - math.sin(math.radians(70.3)))
require(
    "ideal areas: a rounded cone goes over smoothly, and is the sharp one moved",
    near(rounded(touch * (1 - 1e-9)), rounded(touch * (1 + 1e-9)), 1e-6)
    and near(rounded(1e-6), sharp(1e-6 + 1e-7 * (1 / math.sin(math.radians(70.3)) - 1))),
)
require("ideal areas: a wedge has none", op.ideal_area("wedge", half_angle=70.3) is None)

# Finite elements of a cone of 70.3 degrees, nu = 0.3 (Lu et al., PNAS 117 (2020) 7052): C/Y, S/(E'h); the
# area from
# S = 1.1957 E' sqrt(A) (Dao et al., Acta Mater. 49 (2001) 3899)
for ratio, hard, stiff, h_wrong, e_wrong in (
    (700, 97.45, 7.298, 0.56, 0.28),
    (100, 70.00, 6.258, 0.31, 0.17),
):
    modulus = ratio / 0.91
    area = 24.5 * op.contact_depth(1.0, hard, stiff * modulus, 0.75) ** 2
    true = (stiff / 1.1957) ** 2
    require(
        f"pile-up, E/Y = {ratio}: hardness {100 * h_wrong:.0f} % too high",
        abs(true / area - 1 - h_wrong) < 0.015,
    )
    require(
        f"pile-up, E/Y = {ratio}: modulus {100 * e_wrong:.0f} % too high",
        abs(op.reduced_modulus(stiff * modulus, area, 1.034) / modulus - 1 - e_wrong) < 0.015,
    )

value, sigma = op.propagate(lambda a, b: a * b, (2.0, 3.0), np.array([[0.01, 0.002], [0.002, 0.04]]))
require(
    "propagation of correlated values",
    value == 6 and near(sigma, math.sqrt(9 * 0.01 + 4 * 0.04 + 2 * 6 * 0.002), 1e-6),
)
random = np.random.default_rng(1)
white = random.normal(size=4000)
require(
    "correlation time: 1 of white noise, 5 of running means of 5",
    abs(op.correlation_time(white) - 1) < 0.1
    and abs(op.correlation_time(np.convolve(white, np.ones(5) / 5, "valid")) - 5) < 0.8,
)

# ---- made-up curves ----

deepest, final, exponent, top = 200e-9, 170e-9, 1.45, 2e-3
factor = top / (deepest - final) ** exponent
stiffness = factor * exponent * (deepest - final) ** (exponent - 1)
epsilon = op.epsilon_of_exponent(exponent)
edge = deepest - epsilon * top / stiffness
area = op.ideal_area("cone", half_angle=70.3)
exact = {
    "max_depth": deepest,
    "max_load": top,
    "stiffness": stiffness,
    "residual_depth": final,
    "unloading_exponent": exponent,
    "epsilon": epsilon,
    "contact_depth": edge,
    "area_oliver_pharr": area(edge),
    "hardness_oliver_pharr": top / area(edge),
    "modulus_oliver_pharr": op.reduced_modulus(stiffness, area(edge), 1.05),
}


def curve(noise=0.0, seed=0, hold=0, to=0.0, rows=250, together=1):
    """Depth and load: C h^2 in, perhaps a hold, a (h - h_f)^m out down to the share `to` of the way back;
    noise as a share of the load, running means of so many."""
    back = np.linspace(deepest, final + (deepest - final) * to, rows)[1:]
    inward = np.linspace(0, deepest, 500)
    depth = np.r_[inward, [deepest] * hold, back]
    load = np.r_[
        top * (inward / deepest) ** 2, [top] * hold, factor * np.maximum(back - final, 0) ** exponent
    ]
    white = np.random.default_rng(seed).normal(size=depth.size + together - 1)
    return depth, load + noise * top * np.convolve(white, np.ones(together) / math.sqrt(together), "valid")


def analyse(depth, load, **options):
    unloadings = op.find_unloadings(depth)
    assert len(unloadings) == 1
    return op.analyse_unloading(depth, load, unloadings[0], area, 1.05, **options), unloadings[0]


for label, options in (("", {}), (", after a hold", {"hold": 40}), (", partial", {"to": 0.3})):
    depth, load = curve(**options)
    result, unloading = analyse(depth, load)
    require(
        f"without noise all comes back{label}",
        all(near(result.values[key], value, 1e-6) for key, value in exact.items()),
    )
    require(
        f"without noise the uncertainty is next to none{label}", result.sigma["stiffness"] < 1e-6 * stiffness
    )
    values, sigma = op.work(depth, load, unloading, result.fit)
    back = factor * (deepest - final) ** (exponent + 1) / (exponent + 1)
    require(f"work ratio{label}", abs(values["work_ratio"] - (1 - back / (top * deepest / 3))) < 2e-4)
    c, c_sigma, power, _ = op.loading_curvature(depth, load, unloading.start)
    require(
        f"loading curvature{label}",
        near(c, top / deepest**2, 1e-9) and near(power, 2, 1e-6) and c_sigma < 1e-9 * c,
    )
require(
    "a given epsilon is used",
    near(analyse(*curve(), epsilon=1.0)[0].values["contact_depth"], deepest - top / stiffness, 1e-6),
)

for label, options in (("", {}), (", after a hold", {"hold": 40}), (", running means of 5", {"together": 5})):
    apart = {key: [] for key in exact if key != "max_depth"}
    size = {key: [] for key in apart}
    for seed in range(200 if not options else 60):
        depth, load = curve(noise=0.01, seed=seed, **options)
        result, _ = analyse(depth, load)
        for key in apart:
            apart[key].append((result.values[key] - exact[key]) / result.sigma[key])
            size[key].append(result.sigma[key] / exact[key])
    for key, scores in apart.items():
        scores = np.abs(scores)
        within, twice, spread = np.mean(scores < 1), np.mean(scores < 2), math.sqrt(np.mean(scores**2))
        print(
            f"   noise 1 %{label}: {key} +- {np.mean(size[key]):.2%}; within one uncertainty "
            f"{within:.0%}, two {twice:.0%}, rms {spread:.2f}"
        )
        low, high, most = (0.58, 0.86, 1.25) if not options else (0.50, 0.92, 1.45)
        require(
            f"the uncertainty of {key} covers about two thirds of the errors{label}",
            low <= within <= high and twice > 0.85 and 0.6 < spread < most,
        )

# Depths of an instrument scatter too. Scatter of a thousandth of the depth once ended the unloading early:
# the stiffness was 30 to 100 % of the true one, with the uncertainty of the fit.
for share in (0.0005, 0.001, 0.002, 0.004):
    for hold in (0, 50, 200):
        apart, scores = [], []
        for seed in range(10):
            depth, load = curve(hold=hold, to=0.05)
            white = np.random.default_rng(seed).normal(size=depth.size)
            result, unloading = analyse(depth + share * deepest * white, load)
            apart.append(result.values["stiffness"] / stiffness - 1)
            for key in ("max_depth", "stiffness", "contact_depth", "area_oliver_pharr"):
                scores.append(abs(result.values[key] - exact[key]) / result.sigma[key])
        label = f"depths that scatter by {share:.2%}, {hold} rows of hold"
        check(f"{label}: stiffness, relative", apart, 40 * share)
        require(f"{label}: error bars hold ({max(scores):.2f})", max(scores) < 4)

# A curve that no such power law fits: the windows must say so
depth, load = curve()
bent = load + 0.03 * top * np.sin(2 * math.pi * (depth - final) / (deepest - final)) * (
    np.arange(depth.size) > 499
)
result, _ = analyse(depth, bent)
require("a curve of another form gets a larger uncertainty", result.sigma["stiffness"] > 0.02 * stiffness)

# ---- segments and what is refused ----

steps = np.concatenate(
    [
        np.linspace(0, 1, 50),
        np.linspace(1, 0.9, 30),
        np.linspace(0.9, 2, 50),
        [2.0] * 20,
        np.linspace(2, 1.8, 30),
    ]
)
found = op.find_unloadings(steps)
require(
    "two unloadings, the second after a hold",
    [(u.hold, u.start, u.end) for u in found] == [(50, 50, 79), (129, 150, 179)],
)
require(
    "a small way back is none",
    op.find_unloadings(np.r_[np.linspace(0, 1, 50), np.linspace(1, 0.998, 10), np.linspace(0.998, 2, 50)])
    == [],
)
require("a tool above the surface has none", op.find_unloadings(-1 - np.abs(np.linspace(-1, 1, 99))) == [])
require("too few rows", refused("rows between 20 and 98 % of its load", lambda: analyse(*curve(rows=9))))
require(
    "an unloading that stays high",
    refused("% of its load, and a fit needs one that goes down", lambda: analyse(*curve(to=0.9))),
)
finish()
