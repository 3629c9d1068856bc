"""Load of a Vickers pyramid, input/vickers.nml, over that of the cone whose section at each height has the
same area, rounded so that as much of its tip is gone; and of a half-space by the functions of Dao et al.
(2001) for that cone. usage: vickers.py (in an empty directory; GIMP3D is the program)"""

import math
from pathlib import Path

import numpy as np

from run_scene import ROOT, replace, run
from checks import check, finish
from gimp3d.run_data import History

ANGLE, RADIUS, DEPTH = math.radians(68), 20e-9, 0.2e-6
cone = math.atan(math.tan(ANGLE) * 2 / math.sqrt(math.pi))
radius = RADIUS * (1 / math.sin(ANGLE) - 1) / (1 / math.sin(cone) - 1)
text = replace((ROOT / "input/vickers.nml").read_text(), "'out/vickers'", "'pyramid_run'")
run(text, 2)
text = replace(
    text,
    "shape='pyramid', faces=4, half_angle=68, tip_radius=20e-9",
    f"shape='cone', half_angle={math.degrees(cone)!r}, tip_radius={radius!r}",
)
run(replace(replace(text, ", edge=1,0,0", ""), "'pyramid_run'", "'cone_run'"), 2)


def load(name):
    """Means around eight depths of the second half, N."""
    history = History(Path(name) / "tool_vickers.dat")
    return np.array(
        [
            history["load_z"][np.abs(history["depth"] / d - 1) < 0.03].mean()
            for d in np.linspace(0.65, 1, 8) * DEPTH
        ]
    )


pyramid, turned = load("pyramid_run"), load("cone_run")
check(
    "load of the pyramid over that of the cone, mean of the second half, less 1",
    np.mean(pyramid / turned) - 1,
    0.02,
)
check("the same at single depths", pyramid / turned - 1, 0.06)
modulus, yields = 70e9 / (1 - 0.33**2), 300e6 + 1e9 * 0.033  # at a strain of 0.033
x = math.log(modulus / yields)
dao = yields * (-1.131 * x**3 + 13.635 * x**2 - 30.594 * x + 29.267) * DEPTH**2 / 4
print(f"   load at the end over that of a half-space: {pyramid[-1] / dao:.3f}")
check(
    "load at the end over that of a half-space, whose sides are not near, less 1", pyramid[-1] / dao - 1, 0.1
)
finish()
