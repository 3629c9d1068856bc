"""What scratch_long.sh measures: loads on the tip over the last half of its way, groove and pile-up behind
it; and short runs that are to be the same, mirrored or on other numbers of ranks."""

import math

import h5py

from runs import *


def tip(run):
    return History(Path(run) / "tool_tip.dat")


def last_half(history):
    """Rows of the last half of the way across, in four parts."""
    way = np.abs(history["position_x"] - history["position_x"][0])
    return np.array_split(np.flatnonzero(way >= 0.5 * way[-1]), 4)


def steady(history, column):
    """Largest difference of a part's mean from that of all, relative; and the mean of all (N)."""
    means = np.array([np.mean(history[column][part]) for part in last_half(history)])
    return np.max(np.abs(means / np.mean(means) - 1)), np.mean(means)


def heights(path, low, high, cell):
    """Height (m) of the surface over y (m) between two places along the scratch: the highest faces of
    particles."""
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        x, fields = group["Points"][...], group["PointData"]
        top = x[:, 2] + (
            np.abs(fields["domain"][...].reshape(-1, 3, 3)[:, :, 2]).sum(axis=1)
            if "domain" in fields
            else np.atleast_2d(fields["half_size"][...].T).T[:, -1]
        )
    among = (x[:, 0] > low) & (x[:, 0] < high)
    y = np.arange(-8 * cell, 8.01 * cell, cell / 2)
    return y, np.array([top[among & (np.abs(x[:, 1] - at) < cell / 2)].max() for at in y])


history = tip("scratch")
spread_z, normal = steady(history, "load_z")
spread_x, across = steady(history, "load_x")
ratio = -across / normal
estimate = 2 / math.pi / math.tan(math.radians(70.3))
print(
    f"   normal load {1e3 * normal:.1f} mN, tangential {-1e3 * across:.1f} mN, ratio {ratio:.4f}; ploughing "
    f"{estimate:.4f}"
)
check("normal load over the last half of the way", spread_z, 0.03)
check("tangential load over the last half of the way", spread_x, 0.03)
check("load across the scratch, of the normal load", np.abs(history["load_y"]).max() / normal, 1e-4)
check("ratio of the loads over that of ploughing, less 1", ratio / estimate - 1, 0.1)
last, cell, top = sorted(Path("scratch").glob("particles_*.hdf"))[-1], 1e-6, 8e-6
end = history["position_x"][-1]
y, z = heights(last, end - 10 * cell, end - 6 * cell, cell)
print(
    f"   groove {1e6 * (top - z.min()):.2f} um deep behind the tip, {1e6 * (z.max() - top):.2f} um of "
    f"pile-up at {1e6 * abs(y[np.argmax(z)]):.1f} um beside"
)
require("there is a groove", 0.5e-6 < top - z.min() < 1.3e-6)
require("there is pile-up beside it", z.max() > top + 0.05e-6)

reference = tip("short_1")
for name, sign in (("short_mirrored", -1), ("short_2", 1), ("short_4", 1)):
    other = tip(name)
    require(f"{name}: as many rows", other.rows == reference.rows > 100)
    for column in ("load_x", "load_z"):
        sign_here = sign if column == "load_x" else 1
        off = np.abs(reference[column] - sign_here * other[column]).max() / np.abs(reference["load_z"]).max()
        check(f"{name}: {column}", off, 1e-8)
finish()
