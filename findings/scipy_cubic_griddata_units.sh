#!/bin/sh
# SciPy 1.16.3: griddata(method='cubic') gives another surface when the values are in metres than when they
# are in nanometres.
#
# Who is bitten: who brings scattered displacements (image correlation, nodes of a mesh, particles) or heights
#       to a regular grid by griddata or CloughTocher2DInterpolator, and differentiates them to strains or
#       slopes.
# A good guess: interpolation is linear in the values: a thousandth of them gives a thousandth of the surface,
#       to rounding, as method='linear' does. The documents speak of scaling for the points alone
#       (rescale=True).
# Seen: the gradients at the points are found by sweeps, which stop when a gradient changes by less than tol =
#       1e-6 of the larger of 1 and the gradient itself: an absolute number for small ones. 300 points on a
#       unit square, a surface of height 1; values multiplied by 1e-6 and 1e-9 give a surface that is off by
#       .1 and 4 % of the height, and slopes that are off by 1.5 and 36 % of the largest; its largest error
#       grows from 1.2 to 3.6 % of the height. From 1e-9 on the gradients are those of one sweep from 0. No
#       warning. Points multiplied by 1e-9 instead: no change.
# Instead: divide the values by their range before, and multiply after; or hand over tol of
#       CloughTocher2DInterpolator.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.3.5 scipy==1.16.3
cat >"$dir/units.py" <<'END'
import sys

import numpy
import scipy
from scipy.interpolate import griddata

print("SciPy", scipy.__version__)
chance = numpy.random.default_rng(0)
points = chance.uniform(0.0, 1.0, (300, 2))
places = chance.uniform(0.1, 0.9, (500, 2))
step = numpy.array([1e-4, 0.0])


def surface(x):
    return numpy.sin(5.0 * x[:, 0]) * numpy.cos(4.0 * x[:, 1])


def found(method, unit=1.0, length=1.0):
    at = [length * (places + shift) for shift in (0.0 * step, step, -step)]
    mid, up, down = (griddata(length * points, unit * surface(points), x, method=method) / unit for x in at)
    return mid, (up - down) / (2.0 * step[0])


value, slope = found("cubic")
off, steep, error = {}, {}, {}
for unit in (1.0, 1e-3, 1e-6, 1e-9, 1e-12):
    other, gradient = found("cubic", unit)
    off[unit] = abs(other - value).max()
    steep[unit] = abs(gradient - slope).max() / abs(slope).max()
    error[unit] = abs(other - surface(places)).max()
    print(f"values times {unit:g}: off by {off[unit]:.1e}, slope by {steep[unit]:.1e},", end=" ")
    print(f"largest error {error[unit]:.4f}")
linear = abs(found("linear", 1e-9)[0] - found("linear")[0]).max()
scaled = abs(found("cubic", 1.0, 1e-9)[0] - value).max()
print(f"linear, values times 1e-9: off by {linear:.0e}; cubic, points times 1e-9: off by {scaled:.0e}")
seen = 1e-4 < off[1e-6] < 1e-2 < off[1e-9] and steep[1e-9] > 0.1 and error[1e-9] > 2.5 * error[1.0]
sys.exit(0 if seen and linear < 1e-12 and scaled < 1e-7 else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/units.py"
