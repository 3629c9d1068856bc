"""input/love.nml beside Love's half-space: szz along the axis. usage: love.py BOUND CELL [CELL ...] (mm)

Down to 3 half-widths the last grid must be within BOUND of the pressure. Compared is the mean of the two
particles of a cell: single particles alternate about it, which the nodes do not feel; how far is printed."""

import sys

import numpy as np

from run_scene import ROOT, replace, run, seconds_and_particles
from checks import check, finish, require
from runs import energy, snapshots

PRESSURE, HALF, TOP = 40e6, 1e-3, 6e-3


def corner(a, b, z):
    """szz over p at a depth z under the corner of a rectangle a by b under p (Love 1929), pressure
    positive."""
    far = np.sqrt(a * a + b * b + z * z)
    return (np.arctan(a * b / (z * far)) + a * b * z / far * (1 / (a * a + z * z) + 1 / (b * b + z * z))) / (
        2 * np.pi
    )


def half_space(x, y, z):
    """Under a place within the square: the four rectangles that meet there."""
    return sum(corner(HALF + i * x, HALF + j * y, z) for i in (1, -1) for j in (1, -1))


def main():
    for cell in (float(word) * 1e-3 for word in sys.argv[2:]):
        name = f"cell_{cell * 1e3:g}"
        text = replace((ROOT / "input/love.nml").read_text(), "cell_size=0.5e-3", f"cell_size={cell!r}")
        log = run(replace(text, "'out/love'", f"'{name}'"), 2)
        seconds, particles = seconds_and_particles(log)
        rows, last = energy(name), snapshots(name)[-1]
        place = last.fields["position"]
        axis = np.nonzero(
            (np.abs(place[:, :2] - cell / 4) < 0.1 * cell).all(axis=1) & (place[:, 2] > TOP - 3 * HALF)
        )[0]
        require(f"{name}: particles along the axis", len(axis) == round(6 * HALF / cell))
        axis = axis[np.argsort(-place[axis, 2])]
        depth = TOP - place[axis, 2]
        found = -last.fields["stress"][axis, 2] / PRESSURE
        exact = half_space(place[axis, 0], place[axis, 1], depth)
        single = np.abs(found - exact).max()
        depth, found, exact = (np.reshape(values, (-1, 2)).mean(axis=1) for values in (depth, found, exact))
        print(f"cell {cell * 1e3:g} mm: {particles} particles, {seconds:.0f} s")
        print("  depth/half-width  szz/p  half-space  difference")
        for row in zip(depth / HALF, found, exact, found - exact):
            print("  {:16.3f} {:6.3f} {:11.3f} {:11.4f}".format(*row))
        check(
            f"{name}: kinetic energy at the end over work",
            rows["kinetic"][-1] / rows["external_work"][-1],
            1e-3,
        )
        print(
            f"   {name}: largest difference {np.abs(found - exact).max():.4f} p, mean "
            f"{np.abs(found - exact).mean():.4f} p; of a single particle {single:.4f} p"
        )
    check(
        "largest difference from the half-space on the last grid, over p", found - exact, float(sys.argv[1])
    )
    finish()


if __name__ == "__main__":
    main()
