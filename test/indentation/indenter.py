"""hardness.json of a cone of 70.3 degrees in perfectly plastic material (E/Y = 100, nu = 0.3) beside finite
elements.

usage: indenter.py FILE CURVATURE STIFFNESS WORK AREA
       the four: how far off they may be, in per cent but the work ratio, which is absolute; AREA also of the
       hardness

The finite elements: data/FEM_70deg.csv of https://github.com/lululxvi/deep-learning-for-indentation
(Apache-2.0; Lu et al., PNAS 117 (2020) 7052), E = 10 GPa, Y = 0.1 GPa, n = 0: C/Y = 70.0, S/(E' h) = 6.258,
plastic over total work 0.831. Its steps make S uncertain by 3 %. The area from S = 1.1957 E' sqrt(A) (Dao et
al., Acta Mater. 49 (2001) 3899)."""

import json
import sys
from pathlib import Path

from checks import finish, require

answer = json.loads(Path(sys.argv[1]).read_text())
curvature, stiffness, work, area = map(float, sys.argv[2:])
depth, modulus, yield_stress = answer["max_depth"], answer["modulus_scene"], 700e6


def beside(what, value, wanted, bound):
    """Beside finite elements, within a difference."""
    require(
        f"{what}: {value:.4g}, finite elements {wanted:.4g}, within {bound:.2g}", abs(value - wanted) <= bound
    )


beside("C/Y", answer["loading_curvature"] / yield_stress, 70.0, 0.7 * curvature)
beside("S/(E'h)", answer["stiffness"] / modulus / depth, 6.258, 0.06258 * stiffness)
beside("plastic over total work", answer["work_ratio"], 0.831, work)
true = (6.258 / 1.1957) ** 2
beside(
    "area within which the surface touches the tool, over h^2",
    answer["area_profile"] / depth**2,
    true,
    0.01 * true * area,
)
beside(
    "hardness by the true area, over Y", answer["hardness_true"] / yield_stress, 70 / true, 0.7 / true * area
)
beside("exponent of the loading", answer["loading_exponent"], 2.0, 0.15)
beside("kinetic energy over work", answer["kinetic_share"], 0.0, 0.01)
for what, holds in (
    (
        "Oliver and Pharr's hardness is too high, as the surface piles up",
        answer["hardness_oliver_pharr"] > 1.1 * answer["max_load"] / answer["area_profile"],
    ),
    ("the unloaded surface stands above the undeformed one", answer["pile_up_peak_unloaded"] > 0.05 * depth),
    ("nothing is missing", answer["missing"] == []),
):
    require(what, holds)
finish()
