"""What rolling_long.sh measures, beside slab theory: von Karman's equation for a plate in plane strain
between rigid rolls, with Coulomb's friction where it slips, at most the yield stress in shear."""

import h5py

from runs import *

RADIUS, BEFORE, GAP, YIELD, FRICTION, SPEED, SLICE = 0.2, 20e-3, 16e-3, 500e6, 0.2, 25.0, 2e-3


def slab(points=20001):
    """Force and moment on a roll (N/m, N m/m), forward slip, and where the plate has the speed of the rolls
    (m before the exit)."""
    flow = 2 * YIELD / np.sqrt(3)
    x = np.linspace(-np.sqrt(RADIUS * (BEFORE - GAP) - (BEFORE - GAP) ** 2 / 4), 0, points)
    angle = np.arcsin(-x / RADIUS)
    thickness = GAP + 2 * RADIUS * (1 - np.cos(angle))

    def pressure(order, forwards):
        pulled, p = 0.0, np.zeros(points)
        p[order[0]] = flow
        for i, j in zip(order[:-1], order[1:]):
            rub = forwards * min(FRICTION * p[i], flow / 2)
            pulled += 2 * (p[i] * np.tan(angle[i]) - rub) * (x[j] - x[i])
            p[j] = flow - pulled / thickness[j]
        return p

    entry, exit_ = pressure(np.arange(points), 1), pressure(np.arange(points)[::-1], -1)
    p = np.minimum(entry, exit_)
    neutral = np.argmin(np.abs(entry - exit_))
    rub = np.minimum(FRICTION * p, flow / 2) * np.where(entry <= exit_, 1, -1)
    force = np.trapezoid(p + rub * np.tan(angle), x)
    moment = np.trapezoid(rub * RADIUS / np.cos(angle), x)
    return force, moment, thickness[neutral] * np.cos(angle[neutral]) / GAP - 1, -x[neutral]


def thickness(path, low, high):
    """Mean thickness (m) of the plate between two places, from the faces of its highest particles."""
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        x, edges = group["Points"][...], group["PointData/domain"][...].reshape(-1, 3, 3)
    top = x[:, 2] + np.abs(edges[:, :, 2]).sum(axis=1)
    bins = np.arange(low, high, SLICE)
    return 2 * np.mean([top[np.abs(x[:, 0] - at) < SLICE / 2].max() for at in bins])


force, moment, slip, neutral = slab()
roll = History(Path("rolling/tool_roll.dat"))
steady = roll["time"] > 0.55 * roll["time"][-1]
loads = roll["load_z"][steady] / SLICE
moments = roll["moment_y"][steady] / SLICE
front, tail = (History(Path(f"rolling/probe_{name}.dat")) for name in ("front", "tail"))
late = np.searchsorted(front["x"], 5e-3)
require("the plate is taken in", late < front.rows - 100 and tail["x"][-1] < -33e-3)
seconds = front["time"][-1] - front["time"][late]
after, before = ((one["x"][-1] - one["x"][late]) / seconds for one in (front, tail))
last = sorted(Path("rolling").glob("particles_*.hdf"))[-1]
behind = thickness(last, 4e-3, front["x"][-1] - 4e-3)
print(
    f"   force {np.mean(loads) / 1e6:.2f} MN/m, slab theory {force / 1e6:.2f}; moment "
    f"{np.mean(moments) / 1e3:.1f} kN m/m, {moment / 1e3:.1f}; "
    f"forward slip {100 * (after / SPEED - 1):.2f} %, {100 * slip:.2f} %"
)
check("thickness behind the rolls over the gap, less 1", behind / GAP - 1, 0.01)
check("speed times thickness behind over that before, less 1", after * behind / (before * BEFORE) - 1, 0.005)
check("force over that of slab theory, less 1", np.mean(loads) / force - 1, 0.03)
check("moment over that of slab theory, less 1", np.mean(moments) / moment - 1, 0.05)
require("forward slip", 0 < after / SPEED - 1 < 0.1)
check("force: standard deviation over mean", np.std(loads) / np.mean(loads), 0.05)

refused = History(Path("refused/probe_front.dat"))
require("a friction of a quarter does not take the plate in", refused["x"].max() < -34e-3)
finish()
