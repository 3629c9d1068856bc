#!/bin/sh
# scikit-learn 1.7.2: GaussianProcessRegressor(alpha=noise**2, normalize_y=True) takes the noise in units of the data's spread.
#
# Who is bitten: surrogates of simulations and fits of measured curves that know their noise and hand it over as alpha,
#       which the manual calls the variance of the noise of the observations, with targets centred by normalize_y=True.
# A good guess: alpha belongs to the targets as they are given (as with normalize_y=False), so units do not matter.
# Seen: targets are divided by their standard deviation, alpha is not. A load curve with 2 % of noise, alpha = variance of
#       that noise: in newtons the curve runs through every noisy point (residual 1e-5 of the noise or less), in
#       micronewtons it is smoothed away (residual 10 times the noise or more). Without normalize_y the residual is near
#       the noise in each unit. No warning that names alpha.
# Instead: alpha = (noise / std of the targets)**2, or normalise the targets by hand.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check scikit-learn==1.7.2 numpy==2.3.5 scipy==1.16.3
cat >"$dir/units.py" <<'END'
import sys
import warnings

import numpy
import sklearn
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

warnings.simplefilter("ignore")  # of bounds of the kernel, none names alpha
print("scikit-learn", sklearn.__version__)
depth = numpy.linspace(0.0, 1.0, 60)[:, None]
ripple = numpy.random.default_rng(1).normal(0.0, 0.02, 60)
kernel = ConstantKernel(1.0, (1e-12, 1e12)) * RBF(0.3, (1e-2, 1e2))
residual = {}
for unit, one in (("N", 1e-3), ("mN", 1.0), ("uN", 1e3)):
    load = one * (1.0 + 2.0 * depth[:, 0] ** 1.5 + ripple)
    for normalised in (False, True):
        model = GaussianProcessRegressor(kernel, alpha=(0.02 * one) ** 2, normalize_y=normalised)
        left = load - model.fit(depth, load).predict(depth)
        residual[unit, normalised] = numpy.std(left) / (0.02 * one)
        print(f"{unit:2} normalize_y={normalised}: residual over noise {residual[unit, normalised]:.2g}")
plain = all(0.5 < residual[unit, False] < 1.2 for unit in ("N", "mN", "uN"))
seen = plain and residual["N", True] < 1e-3 and residual["uN", True] > 5.0
sys.exit(0 if seen else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/units.py"
