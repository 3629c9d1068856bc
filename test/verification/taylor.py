"""Taylor bar, input/taylor.nml, beside the experiment. usage: taylor.py CELLS [CELLS ...]     cells along the
radius

Diameters are those of the outermost particle of a layer of one cell, with half a particle's first edge
added."""

import sys

import numpy as np

from run_scene import ROOT, replace, run, seconds_and_particles
from checks import check, finish, require
from runs import energy, snapshots

RADIUS, LENGTH = 3.81, 25.4  # mm
# mm: Johnson and Holmquist (1988)
MEASURED = {"length": 16.2, "diameter of the foot": 13.5, "diameter at 0.2 of the first length": 10.1}
PLAIN, LOCKING = (
    ("safety=0.3", "safety=0.3, transfer='plain'"),
    ("&anti_locking /\n", "&anti_locking kind='none' /\n"),
)
CASES = {
    "affine, anti-locking": [],
    "affine": [LOCKING],
    "plain, anti-locking": [PLAIN],
    "plain": [LOCKING, PLAIN],
}


def main():
    for cells in (int(word) for word in sys.argv[1:]):
        cell = RADIUS / cells
        for case, changes in CASES.items():
            name = f"{case.replace(', ', '_')}_{cells}"
            text = replace((ROOT / "input/taylor.nml").read_text(), "0.508e-3", f"{cell * 1e-3!r}")
            text = replace(
                text,
                "upper=9.144e-3,9.144e-3,27.432e-3",
                "upper="
                + ",".join(
                    repr(n * cell * 1e-3)
                    for n in (round(2.4 * cells), round(2.4 * cells), round(7.2 * cells))
                ),
            )
            text = replace(text, "'out/taylor', every=20e-6", f"'{name}'")
            for old, new in changes:
                text = replace(text, old, new)
            seconds, particles = seconds_and_particles(run(text, 2))
            rows, last = energy(name), snapshots(name)[-1]
            place = last.fields["position"] * 1e3
            out = np.hypot(place[:, 0], place[:, 1]) + cell / 4
            at = place[:, 2]
            found = {
                "length": at.max() + cell / 4,
                "diameter of the foot": 2 * out[at < cell].max(),
                "diameter at 0.2 of the first length": 2 * out[np.abs(at - 0.2 * LENGTH) < cell / 2].max(),
            }
            print(
                f"{case}, {cells} cells a radius: {particles} particles, {seconds:.0f} s; plastic strain at "
                f"most {last.fields['plastic_strain'].max():.2f}, temperature at most "
                f"{last.fields['temperature'].max():.0f} K"
            )
            for what, value in found.items():
                print(
                    f"   {what:38s} {value:6.2f} mm, measured {MEASURED[what]:5.1f} mm, "
                    f"{100 * (value / MEASURED[what] - 1):+5.1f} %",
                    flush=True,
                )
            require(f"{name}: the bar has come to rest", rows["kinetic"][-1] < 0.02 * rows["kinetic"][0])
            check(f"{name}: balance of energy", rows["balance_error"], 0.03)
            check(f"{name}: length over the measured", found["length"] / MEASURED["length"] - 1, 0.10)
            check(
                f"{name}: diameter of the foot over the measured",
                found["diameter of the foot"] / MEASURED["diameter of the foot"] - 1,
                0.15,
            )
    finish()


if __name__ == "__main__":
    main()
