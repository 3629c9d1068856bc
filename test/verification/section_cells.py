"""How small cells must be for 1 % of the load, with the compliance below a cell and without, and what that
takes: rigid tools on an elastic cylinder by its section on levels, beside finite elements (test/references/fem).
usage: section_cells.py (in an empty directory; GIMP3D is the program)"""

import re
from pathlib import Path

import numpy as np
from checks import finish, require
from section_fem import TOOLS, press

OFF = "&contact subcell=0 /"
CELLS = {  # um; 20 um over the coarsest of a row of halved ones is a whole number
    "": {
        "sphere": (2, 1.25, 1, 0.8, 0.625, 0.5),
        "cone": (1.25, 1, 0.8, 0.625, 0.5, 0.4),
        "flat": (2, 1.25, 1, 0.8, 0.5),
    },
    OFF: {
        "sphere": (1.25, 1, 0.8, 0.625, 0.5, 0.4),
        "cone": (1, 0.8, 0.625, 0.5, 0.4, 0.3125),
        "flat": (0.5, 0.25, 0.2, 0.125, 0.1),
    },
}
WANTED = {"sphere": 1.5, "cone": 1.2, "flat": 4.0}


def base_of(cell):
    """The cell far from the tool, um: at least 0.8."""
    while cell < 0.79:
        cell *= 2
    return cell


def processor_time(kind, cell, contact):
    log = Path(f"{kind}_{cell:g}{'_without' if contact else ''}/run.log").read_text()
    return float(re.search(r"processors: ([0-9.]+) s", log)[1])


def crossing(cells, errors, times):
    """The cell below which errors stay under 1 %, and the processor's time there: between those of the table by
    their logarithms; beyond the finest one by the two finest, where it is near."""
    cells, errors, times = np.log(cells), np.log(errors), np.log(times)
    first = min(np.flatnonzero(np.maximum.accumulate(errors[::-1])[::-1] < 0), default=len(cells) - 1)
    coarse, fine = max(first - 1, 0), max(first, 1)
    share = errors[coarse] / (errors[coarse] - errors[fine])
    require("the cell for 1 % is in the table, or near", -0.5 < share < 1.6)
    cell, time = (values[coarse] + share * (values[fine] - values[coarse]) for values in (cells, times))
    return np.exp(cell), np.exp(time)


print("| tool | term | cell [nm]: mean, rms [%], processor [s] | for 1 %: cell [nm], processor [s] |")
for kind in TOOLS:
    need = {}
    for contact, cells in CELLS.items():
        found = []
        for cell in cells[kind]:
            mean, scatter, *_ = press(kind, cell, contact, base_of(cell))
            found.append((mean, np.hypot(mean, scatter), processor_time(kind, cell, contact)))
        _, errors, times = np.array(found).T
        need[contact] = crossing(cells[kind], errors, times)
        text = "; ".join(
            f"{1e3 * c:g}: {m:+.2f}, {r:.2f}, {t:.2g}" for c, (m, r, t) in zip(cells[kind], found)
        )
        cell, time = need[contact]
        print(
            f"| {kind} | {'no' if contact else 'yes'} | {text} | {1e3 * cell:.0f}, {time:.2g} |", flush=True
        )
    (cell, time), (cell_without, time_without) = need[""], need[OFF]
    print(
        f"   {kind}: cells {cell / cell_without:.2f} times as large, "
        f"in 1/{time_without / time:.1f} of the time"
    )
    require(
        f"{kind}: cells for 1 %, at least {WANTED[kind]} times as large", cell >= WANTED[kind] * cell_without
    )
finish()
