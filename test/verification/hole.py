"""The stress at a hole in a plate, input/plate_with_hole.nml, against Kirsch's 3 with Heywood's correction
for the finite width. usage: hole.py (in an empty directory; GIMP3D is the program)"""

import numpy as np

from run_scene import ROOT, replace, run
from checks import check, finish, require
from runs import snapshots

RADIUS, WIDTH, STRESS = 8e-3, 80e-3, 100e6
run(replace((ROOT / "input/plate_with_hole.nml").read_text(), "'out/plate_with_hole'", "'hole'"), 2)
last = snapshots("hole")[-1].fields
x, stress = last["position"], last["stress_recovered"][:, 0]
check(
    "speed at the end, over what would make 1 % of the stress",
    np.abs(last["velocity"]).max() / (0.01 * STRESS / (7800 * 5e3)),
    1.0,
)
line = (x[:, 0] < 0.5e-3) & (x[:, 1] < 1.5 * RADIUS)
require("particles beside the hole", line.sum() > 10)
r = x[line, 1] / RADIUS
shape = 0.5 * (2 + 1 / r**2 + 3 / r**4)  # of sxx over the distant stress on x = 0
ratio = np.polyval(np.polyfit(r, stress[line] / STRESS / shape, 1), 1.0)
share = 1 - 2 * RADIUS / WIDTH
check(
    "stress at the hole over that of an infinite plate, for the finite width",
    3 * ratio / ((2 + share**3) / share) / 1.0 - 1,
    0.05,
)
finish()
