"""The shipped curves of other laws and tips, identified by the command that identification.md has; the
intervals hold the truth as often as 90 % intervals do. The curves are those of runs on other cells and at
another speed, with 1 % of noise. usage: identify_curves.py ROOT GIMP3D; with --make the curves are written anew"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binom

from gimp3d.identification import forward, page, surrogate
from gimp3d.identification.cache import Cache
from gimp3d.identification.laws import KNOWN
from gimp3d.identification.tips import read_tip
from gimp3d.identify import identify

from checks import close, finish, require

ROOT, PROGRAM = Path(sys.argv[1]), sys.argv[2]
FOLDER = ROOT / "input/identification"
YOUNG, DEPTH, NOISE, ROWS = 7e10, 300e-9, 0.01, 450
REPRESENTATIVE = 0.033  # plastic strain
SHARP = forward.Numerics(cells=3.0, fine=12, speed=1.0, back=0.0035)
BENT = forward.Numerics(cells=3.2, fine=18, speed=0.5, back=0.003, fastest=0.006)


@dataclass
class Experiment:
    """curves: file: TIP; ratio: E over yield stress; shape: coordinates of the law; stress: how far the
    stress at 3.3 % strain may be off."""

    curves: dict
    law: str
    ratio: float
    shape: tuple
    stress: float

    @property
    def words(self):
        """What the command takes."""
        found = [f"LAW={self.law}", "REFINE=no"]
        for name, tip in self.curves.items():
            found += [f"DATA={FOLDER / name}", f"TIP={tip}"]
        return found

    @property
    def truth(self):
        """By the names of answer.json, SI units."""
        law, yield_stress = KNOWN[self.law], YOUNG / self.ratio
        found = {"modulus": YOUNG / (1 - forward.Case.poisson**2), "yield_stress": yield_stress}
        found |= dict(zip(law.names, law.constants(yield_stress, self.shape)))
        found["stress_0.033"] = law.stress(YOUNG, yield_stress, self.shape, REPRESENTATIVE)
        return {name: float(value) for name, value in found.items()}


EXPERIMENTS = (
    Experiment(
        {"voce_70.csv": "cone:70.3", "voce_60.csv": "cone:60"}, "voce", 175.0, (0.8, math.log(15.0)), 0.06
    ),
    Experiment({"ludwik_70.csv": "cone:70.3", "ludwik_60.csv": "cone:60"}, "ludwik", 175.0, (0.5, 1.0), 0.06),
    Experiment({"rounded.csv": "cone:70.3:rounding=50nm"}, "power", 200.0, (0.2,), 0.04),
    Experiment({"blunted.csv": "area:24.5,1200"}, "power", 200.0, (0.2,), 0.04),
)


def make():
    """Run the tips in the metals, and write the curves: those of the features, without waves."""
    cache = Cache("truth", shipped=None)
    for number, one in enumerate(EXPERIMENTS):
        law = KNOWN[one.law]
        for name, words in one.curves.items():
            tip, reference = read_tip(words).model(DEPTH)
            case = forward.Case(
                tip, one.ratio, one.shape, numerics=BENT if tip.has_length else SHARP, law=one.law
            )
            cache.run([case], program=PROGRAM)
            features = surrogate.features(case, cache[case]["kept"])
            features[0] += np.log(one.truth["stress_0.033"])
            features[1] += features[0] - np.log(YOUNG)
            depth, load = page.model_curve(features, DEPTH, reference)
            at = np.linspace(0, len(depth) - 1, ROWS)
            depth, load = (np.interp(at, np.arange(len(column)), column) for column in (depth, load))
            rng = np.random.default_rng(10 * number + int(words == "cone:60"))
            load += NOISE * load.max() * rng.standard_normal(ROWS)
            metal = ", ".join(f"{key} {one.truth[key]:.4g}" for key in ("yield_stress", *law.names))
            (FOLDER / name).write_text(
                f"# TIP={words} in a metal of the law {one.law} (young {YOUNG:g}, {metal}; SI): made by a "
                f"run, with {100 * NOISE:g} % of noise\ndepth [nm], load [mN]\n"
                + "".join(f"{1e9 * a:.3f}, {1e3 * b:.6f}\n" for a, b in zip(depth, load))
            )
            print(FOLDER / name)


def main():
    held = []
    for one in EXPERIMENTS:
        title = ", ".join(one.curves)
        record = identify([*one.words, f"PROGRAM={PROGRAM}", "OUT=out", "CACHE=cache"])
        intervals = record["intervals_90"]
        for name, value in one.truth.items():
            low, middle, high = (intervals[name][key] for key in ("low", "median", "high"))
            held.append(low <= value <= high)
            print(
                f"   {title}: {name} {value:.4g} (SI), found {middle:.4g}, 90 % {low:.4g} to {high:.4g}"
                + ("" if held[-1] else ", which does not hold it"),
                flush=True,
            )
        close(
            f"{title}: stress (Pa) at 3.3 % strain",
            intervals["stress_0.033"]["median"], one.truth["stress_0.033"], one.stress,
        )  # fmt: skip
        require(
            f"{title}: the model fits the data (chi-squared {record['chi2']:.3g} for "
            f"{record['degrees_of_freedom']} degrees of freedom)",
            not any("does not fit" in sentence for sentence in record["sentences"]),
        )
        print(f"   {record['processor_seconds']:.0f} s of the processor for the runs", flush=True)
    least = binom.ppf(0.02, len(held), 0.9)  # fewer are seen in 2 % of such tables
    require(
        f"of {len(held)} 90 % intervals {sum(held)} hold the truth, at least {least:.0f}", sum(held) >= least
    )


def exchanged():
    """Negative control: each of two curves under the tip of the other does not fit."""
    one = Experiment(dict(zip(EXPERIMENTS[0].curves, ("cone:60", "cone:70.3"))), "power", 175.0, (0.1,), 0.0)
    record = identify([*one.words, f"PROGRAM={PROGRAM}", "OUT=out", "CACHE=cache"])
    require(
        f"tips exchanged: does not fit (chi-squared {record['chi2']:.3g})",
        any("does not fit" in sentence for sentence in record["sentences"]),
    )


if __name__ == "__main__":
    if "--make" in sys.argv:
        make()
    else:
        main()
        exchanged()
    finish()
