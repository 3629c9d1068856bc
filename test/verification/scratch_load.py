"""What scratch_load_long.sh measures: the tip keeps its load while it is dragged, and its depth and the
tangential load become steady; the ratio of the loads is that of ploughing, and what a tip at a given depth
has (input/scratch.nml)."""

import math

from runs import *

LOAD, SURFACE = 0.04, 8e-6
tip = History(Path("scratch_load/tool_tip.dat"))
way = tip["position_x"] - tip["position_x"][0]
parts = np.array_split(np.flatnonzero(way >= 0.5 * way[-1]), 4)


def means(values):
    return np.array([values[part].mean() for part in parts])


normal, across, depth = means(tip["load_z"]), -means(tip["load_x"]), SURFACE - means(tip["position_z"])
ratio, ploughing = across.mean() / normal.mean(), 2 / math.pi / math.tan(math.radians(70.3))
print(
    f"   normal load {1e3 * normal.mean():.2f} mN, tangential {1e3 * across.mean():.2f} mN, ratio "
    f"{ratio:.4f}, ploughing {ploughing:.4f}; "
    f"depth {1e6 * depth.mean():.3f} um, at most {1e6 * (SURFACE - tip['position_z'].min()):.3f} um"
)
check("way over the given one, less 1", way[-1] / (80 * 3.65e-7) - 1, 1e-6)
check("normal load over what pushes, less 1", normal / LOAD - 1, 0.01)
check("tangential load of a part over that of all, less 1", across / across.mean() - 1, 0.03)
check("depth of a part over that of all, less 1", depth / depth.mean() - 1, 0.03)
check("ratio of the loads over that of ploughing, less 1", ratio / ploughing - 1, 0.1)
# load goes with the square of the depth: at the load of input/scratch.nml, whose tip is 1.2 um deep
check(
    "load over the square of the depth, over that at a given depth, less 1",
    2 * LOAD / depth.mean() ** 2 / (79.4e-3 / 1.2e-6**2) - 1,
    0.1,
)
finish()
