"""Curves of a known truth with noise of the load, of the depth, of both, and of depths from which a
compliance was taken off with the measured load; with what is FREE in them. One sigma and 90 % intervals
hold the truth as often as they say, within what the number of curves tells. Negative control: all noise
taken as the load's. usage: identify_noise.py CURVES [long]"""

import itertools
import sys

import numpy as np
from scipy.stats import binom

from gimp3d.identification import forward, measured, observed
from gimp3d.identification.tips import Tip

from checks import finish, require

CURVES, LONG = int(sys.argv[1]), "long" in sys.argv
TIP, DEPTH, IN, OUT = Tip("cone", 70.3), 300e-9, 30.0, 15.0  # s
TRUTH = np.array([np.log(18e9), np.log(0.018), 0.8])
LOAD = np.exp(TRUTH[0]) * DEPTH**2
COMPLIANCE, ZERO = 5e-6, 2e-9  # m/N, m
# sigma of the load over its largest, of the depth (m), compliance that was taken off (m/N)
NOISES = {
    "load 1 %": (0.01, 0.0, 0.0), "depth .1 nm": (0.0, 0.1e-9, 0.0), "depth .3 nm": (0.0, 0.3e-9, 0.0),
    "depth 1 nm": (0.0, 1e-9, 0.0), "load .2 %, depth .3 nm": (0.002, 0.3e-9, 0.0),
    "load .5 %, 5 nm/mN taken off": (0.005, 0.0, 5e-6),
    "load .5 %, depth .1 nm, 3 nm/mN taken off": (0.005, 0.1e-9, 3e-6),
}  # fmt: skip
FREES = [(), ("zero",), ("compliance",), ("drift",), ("compliance", "drift"), observed.FREE]
if not LONG:
    FREES = FREES[::2]
RARE = 1e-3  # share of right programs that a check would find wrong


def made(noise, free, seed):
    """A curve, and the corrections that are in it. A drift is drawn from what is expected of one."""
    load_sigma, depth_sigma, taken_off = noise
    rng = np.random.default_rng(seed)
    h, share = np.linspace(0, DEPTH, 300), np.linspace(1, 0.03, 151)[1:]
    recovered = forward.full_recovery(np.exp(TRUTH[1]), TRUTH[2])
    load = np.concatenate([np.exp(TRUTH[0]) * h**2, LOAD * share])
    h = np.concatenate([h, DEPTH * (1 - recovered * (1 - share ** TRUTH[2]))])
    time = np.concatenate([np.linspace(0, IN, 300), IN + OUT * np.arange(1, 151) / 150])
    drift = observed.DRIFT * DEPTH / (IN + OUT) * rng.standard_normal()
    given = {name: {"zero": ZERO, "compliance": COMPLIANCE, "drift": drift}[name] for name in free}
    h = h + given.get("zero", 0.0) + given.get("compliance", 0.0) * load + given.get("drift", 0.0) * time
    error = load_sigma * LOAD * rng.standard_normal(load.size)
    h = h - taken_off * error + depth_sigma * rng.standard_normal(load.size)
    return measured.Curve("made", h, load + error, time), given


def scores(noise, free, seed):
    """How far each number is off, in its sigmas."""
    curve, given = made(noise, free, seed)
    seen = observed.from_curves(TIP, [curve], free)
    found = list((seen.values - TRUTH) / np.sqrt(np.diag(seen.covariance)))
    for name, value in given.items():
        middle, sigma = seen.corrections[name][0]
        found.append((middle - value) / sigma)
    return found, seen.unusual


def rates(title, rows):
    """Of one number a curve: the shares within one sigma and in 90 % intervals."""
    for share, reach in ((0.6827, 1.0), (0.9, 1.645)):
        inside, count = int(np.sum(np.abs(rows) < reach)), len(rows)
        low, high = binom.ppf([RARE, 1 - RARE], count, share)
        require(
            f"{title}: {inside} of {count} within {reach:g} sigma, {low:.0f} to {high:.0f} are expected",
            low <= inside <= high,
        )


def main():
    names = ["ln C", "ln recovery", "1/m"]
    table = {name: [] for name in (*names, *observed.FREE)}
    warned = 0
    pairs = list(itertools.product(NOISES, FREES))
    for number, (noise, free) in enumerate(pairs):
        here = []
        for seed in range(CURVES):
            found, unusual = scores(NOISES[noise], free, 1000 * number + seed)
            warned += len(unusual)
            here.append(found)
            for name, score in zip((*names, *free), found):
                table[name].append(score)
        here = np.array(here)
        print(
            f"   {noise}, FREE={','.join(free) or 'none'}: rms of ln C, recovery, 1/m and what is free "
            f"{np.round(np.sqrt(np.mean(here**2, axis=0)), 2)} sigma, largest {np.abs(here).max():.2f}",
            flush=True,
        )
        if LONG:
            worst = np.sqrt(np.mean(here**2, axis=0)).max()
            require(f"   none is off by far: {worst:.2f}", worst < 1 + 4 / np.sqrt(2 * CURVES))
    for name, rows in table.items():
        rates(name, np.array(rows))
    require(f"of {len(pairs) * CURVES} curves the model is said not to fit {warned}", warned == 0)
    right = observed.Noise.of_differences
    observed.Noise.of_differences = staticmethod(
        lambda parts, curve, before=None: observed.Noise(0.01 * curve.load)
    )
    off = [scores(NOISES["depth .1 nm"], ("drift",), seed)[0][0] for seed in range(3)]
    observed.Noise.of_differences = right
    require(
        f"all noise taken as the load's: C is off by {np.round(off, 1)} sigma", np.min(np.abs(off)) > 3
    )


def refused(title, curve, free, word):
    try:
        observed.from_curves(TIP, [curve], free)
        require(f"{title}: refused", False)
    except (measured.Unreadable, observed.NoUnloading) as error:
        require(f"{title}: {error}", word in str(error))


def what_does_not_fit():
    """Curves that are wrong in themselves are refused, or said not to fit; right ones are not."""
    curve, _ = made(NOISES["load .2 %, depth .3 nm"], (), 1)
    depth, load = curve.depth, curve.load
    plain = measured.Curve("plain", depth, load)
    refused("no time", plain, ("drift",), "FREE=drift requires a column of time")
    back = measured.Curve("back", depth, load, curve.time[::-1])
    refused("times that fall", back, (), "the times fall")
    refused("rows in reverse order", measured.Curve("reverse", depth[::-1], load[::-1]), (), "order")
    into = measured.Curve("in", depth[:300], load[:300])
    refused("no unloading", into, (), "the curve has no unloading")
    seen = observed.from_curves(TIP, [plain])
    require("a right curve fits", not seen.unusual)
    before = np.arange(200) * 1e-9
    late = measured.Curve("late", np.r_[before, depth + 200e-9], np.r_[0 * before, load])
    seen = observed.from_curves(TIP, [late])
    require(f"200 nm of approach: {seen.unusual}", any("FREE=zero" in one for one in seen.unusual))
    seen = observed.from_curves(TIP, [late], ("zero",))
    off = (seen.values - TRUTH) / np.sqrt(np.diag(seen.covariance))
    zero, sigma = seen.corrections["zero"][0]
    require(
        f"with FREE=zero: off by {np.round(off, 1)} sigma, zero {1e9 * zero:.2f} +- {1e9 * sigma:.2f} nm",
        not seen.unusual and np.max(np.abs(off)) < 4 and abs(zero - 200e-9) < 4 * sigma,
    )
    # an unloading that the depth hides: its scatter, or the swing of a stiffness that is measured all the way
    hidden, _ = made((0.002, 2e-9, 0.0), (), 2)
    x = np.linspace(0, 1, 3000)
    swing = 1.5e-9 * np.sin(2 * np.pi * 400 * x) * np.minimum(1, 3 * x)
    stiff = 2 * LOAD / DEPTH * 12 * x
    rng = np.random.default_rng(3)
    swung = measured.Curve(
        "swung", np.r_[x * DEPTH + swing, depth[300:]],
        np.r_[LOAD * x**2 + stiff * swing, load[300:]] + 0.005 * LOAD * rng.standard_normal(3150),
    )  # fmt: skip
    for title, one in (("2 nm of scatter", hidden), ("a depth that swings by 1.5 nm", swung)):
        seen = observed.from_curves(TIP, [one])
        off = (seen.values - TRUTH) / np.sqrt(np.diag(seen.covariance))
        require(f"{title}: off by {np.round(off, 1)} sigma", np.max(np.abs(off)) < 4)


what_does_not_fit()
if CURVES:
    main()
finish()
