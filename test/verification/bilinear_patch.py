"""E5, input/bilinear_patch.nml, on several grids: stresses and plastic strain at the point (0.25, 0.25, 6.75)
mm at 100, 200, 300 and 400 MPa. No grid has a particle there: the value is the mean of the eight around it,
symmetrical about it on every grid.

usage: bilinear_patch.py CELL [CELL ...] [--locking] [--falling]     cells in mm
--locking  without the scene's &anti_locking
--falling  the largest change from grid to grid must fall
"""

import argparse
import re

import numpy as np

from run_scene import ROOT, probe, replace, run, seconds_and_particles
from checks import check, finish, require
from runs import energy

POINT = (0.25, 0.25, 6.75)  # mm
LEVELS = (100, 200, 300, 400)  # MPa
SHOWN = (
    ("von Mises [MPa]", "von_mises", 1e-6),
    ("szz [MPa]", "stress_zz", 1e-6),
    ("sxx [MPa]", "stress_xx", 1e-6),
    ("plastic strain [%]", "equivalent_plastic_strain", 100.0),
)


def solve(cell, locking):
    """Run one grid; the table (quantity, level), and what was spent."""
    name = f"cell_{cell:g}{'_locking' if locking else ''}"
    text = (ROOT / "input/bilinear_patch.nml").read_text()
    text = replace(text, "cell_size=0.5e-3", f"cell_size={cell * 1e-3!r}")
    text = replace(text, "'out/bilinear_patch', every=5e-6", f"'{name}', formats='none'")
    text = re.sub("^&probe.*\n", "", text, flags=re.M)
    if locking:
        text = replace(text, "&anti_locking /\n", "&anti_locking kind='none' /\n")
    places = [[POINT[i] + (corner >> i & 1) * cell / 2 - cell / 4 for i in range(3)] for corner in range(8)]
    for corner, place in enumerate(places):
        text += f"&probe name='p{corner}', position={','.join(repr(x * 1e-3) for x in place)} /\n"
    log = run(text, 2)
    probes = [probe(name, f"p{corner}") for corner in range(8)]
    for one, place in zip(probes, places):
        start = np.array([one[axis][0] for axis in "xyz"])
        require(
            f"{name}: a particle stands where the probe asks for it",
            np.abs(start - np.array(place) * 1e-3).max() < 1e-9,
        )
    pressure = 400 * probes[0]["time"] / 20e-6
    table = np.array(
        [
            np.interp(LEVELS, pressure, factor * np.mean([one[column] for one in probes], axis=0))
            for _, column, factor in SHOWN
        ]
    )
    rows = energy(name)
    late = rows["time"] > 5e-6
    check(
        f"{name}: kinetic energy over work from 100 MPa on",
        rows["kinetic"][late] / rows["external_work"][late],
        0.02,
    )
    check(f"{name}: balance of energy", rows["balance_error"][late], 0.02)
    seconds, particles = seconds_and_particles(log)
    return table, f"{particles} particles, {seconds:.0f} s"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cells", nargs="+", type=float)
    parser.add_argument("--locking", action="store_true")
    parser.add_argument("--falling", action="store_true")
    args = parser.parse_args()
    tables = []
    for cell in args.cells:
        table, spent = solve(cell, args.locking)
        tables.append(table)
        print(f"cell {cell:g} mm: {spent}", flush=True)
    print("                      at" + "".join(f"{level:8d} MPa" for level in LEVELS))
    for row, (title, _, _) in enumerate(SHOWN):
        for cell, table in zip(args.cells, tables):
            print(f"{title:18s} {cell:5g}" + "".join(f"{value:12.3f}" for value in table[row]))
        for coarse, fine, cell in zip(tables, tables[1:], args.cells[1:]):
            print(f"   change to {cell:12g}" + "".join(f"{value:12.3f}" for value in fine[row] - coarse[row]))
    for row, (title, _, _) in enumerate(SHOWN):
        sizes = [np.abs(fine[row] - coarse[row]).max() for coarse, fine in zip(tables, tables[1:])]
        if args.falling:
            require(
                f"{title}: the largest change falls from grid to grid: {sizes}",
                all(b < a for a, b in zip(sizes, sizes[1:])),
            )
        scale = np.abs(tables[-1][row]).max()
        print(
            f"{title}: largest change over the largest value: "
            + ", ".join(f"{size / scale:.3f}" for size in sizes)
        )
    finish()


if __name__ == "__main__":
    main()
