"""B1 of the book of benchmarks at E/Y = 100, n = 0 by finite elements of another program, CalculiX (`apt-get install
calculix-ccx`): what a user would take instead of a section. A rigid cone of 70.3 degrees without friction in metal
that does not harden; axisymmetric elements of 8 nodes with reduced integration (CAX8R), large strains, contact of
nodes with the cone by a penalty. The same body as the book's: a disk bonded to its base, of which the depth is freed.

usage: cone_calculix.py CELLS...     CELLS: elements to the radius of the contact (3, 6, 12); a row is printed for each:
elements, C/Y, its error (%), seconds of the processor"""

import math
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

ANGLE = math.radians(70.3)
YOUNG, POISSON, YIELD = 100.0, 0.3, 1.0
EXACT = 70.0  # C/Y of test/references/indentation.toml
BASE = 0.438  # q of the depth q P/(E' t) that a rigid base takes (post/gimp3d/layered.py)
RADIUS = 2.953  # of the contact over the depth, by the stiffness of the table
HEIGHT, WIDTH = 26.7, 53.3  # radii of the contact, as the book's coarse grid
CORE, DEEP, GROWTH = 1.5, 1.0, 1.2  # radii of evenly fine elements, along and down; growth of the others
INCREMENTS = 40


def lines(cell, even, length):
    """Places of lines between elements: even up to `even`, then wider and wider."""
    at = [cell * i for i in range(round(even / cell) + 1)]
    steps, width = [], cell
    while at[-1] + sum(steps) < length:
        width *= GROWTH
        steps.append(width)
    return np.array(at + list(at[-1] + np.cumsum(steps) * (length - at[-1]) / sum(steps)))


def deck(cells):
    """The input file for a contact of radius 1 and the depth that it has."""
    depth = 1 / RADIUS
    x, z = lines(1 / cells, CORE, WIDTH), lines(1 / cells, DEEP, HEIGHT)
    halves = lambda at: np.sort(np.concatenate([at, (at[1:] + at[:-1]) / 2]))
    xs, zs = halves(x), -halves(z)
    number, text = {}, ["*NODE, NSET=BODY"]
    for k, low in enumerate(zs):
        for i, far in enumerate(xs):
            if i % 2 and k % 2:
                continue
            number[i, k] = len(number) + 1
            text.append(f"{number[i, k]}, {far:.12g}, {low:.12g}")
    text.append("*ELEMENT, TYPE=CAX8R, ELSET=METAL")
    count, top = 0, []
    for k in range(0, len(zs) - 2, 2):
        for i in range(0, len(xs) - 2, 2):
            count += 1
            corners = [(i, k + 2), (i + 2, k + 2), (i + 2, k), (i, k)]
            middles = [(i + 1, k + 2), (i + 2, k + 1), (i + 1, k), (i, k + 1)]
            text.append(f"{count}, " + ", ".join(str(number[one]) for one in corners + middles))
            if k == 0 and xs[i + 2] < 1.4 * CORE:
                top.append(count)
    first = len(number) + 1
    reach, faces = 2.5, 25  # of the cone along r, radii; its elements
    far = np.linspace(0, reach, faces + 1)
    far[0] = 1e-4  # faces that end on the axis are not met
    text.append("*NODE, NSET=CONE")
    for n, r in enumerate(far):
        text.append(f"{first + 2 * n}, {r:.12g}, {r / math.tan(ANGLE):.12g}")
        text.append(f"{first + 2 * n + 1}, {r:.12g}, {r / math.tan(ANGLE) + 1:.12g}")
    text.append("*ELEMENT, TYPE=CAX4, ELSET=TOOL")
    for n in range(faces):
        low = first + 2 * n
        text.append(f"{count + 1 + n}, {low}, {low + 2}, {low + 3}, {low + 1}")
    text += ["*NSET, NSET=BASE"] + [str(number[i, len(zs) - 1]) for i in range(len(xs))]
    text += ["*NSET, NSET=AXIS"] + [str(number[0, k]) for k in range(len(zs))]
    text += ["*SURFACE, NAME=TOP"] + [f"{one}, S3" for one in top]
    text += ["*SURFACE, NAME=FACE"] + [f"{count + 1 + n}, S1" for n in range(faces)]
    text += [
        "*MATERIAL, NAME=METAL",
        "*ELASTIC",
        f"{YOUNG}, {POISSON}",
        "*PLASTIC",
        f"{YIELD}, 0.",
        f"{YIELD * (1 + 1e-6)}, 10.",
        "*MATERIAL, NAME=STIFF",
        "*ELASTIC",
        f"{100 * YOUNG}, {POISSON}",
        "*SOLID SECTION, ELSET=METAL, MATERIAL=METAL",
        "*SOLID SECTION, ELSET=TOOL, MATERIAL=STIFF",
        "*SURFACE INTERACTION, NAME=SMOOTH",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{200 * YOUNG * cells:g}, 1e-3",
        "*CONTACT PAIR, INTERACTION=SMOOTH, TYPE=SURFACE TO SURFACE",
        "TOP, FACE",
        "*BOUNDARY",
        "BASE, 1, 2",
        "AXIS, 1, 1",
        "CONE, 1, 1",
        f"*STEP, NLGEOM, INC={50 * INCREMENTS}",
        "*STATIC",
        f"{1 / INCREMENTS}, 1., 1e-6, {1 / INCREMENTS}",
        "*BOUNDARY",
        f"CONE, 2, 2, {-depth:.12g}",
        "*NODE PRINT, NSET=CONE, TOTALS=ONLY",
        "RF",
        "*END STEP",
    ]
    return "\n".join(text) + "\n", count, depth


def loads(text):
    """Time and total force along the axis of a .dat file; printed for a part of the circle of 2 degrees."""
    rows, now = [], None
    lines = text.splitlines()
    for n, line in enumerate(lines):
        if "total force" in line:
            now = float(line.split("time")[1])
            values = next(one for one in lines[n + 1 :] if one.strip())
            rows.append((now, 180 * float(values.split()[1])))
    return np.array(rows)


def press(cells):
    text, count, depth = deck(cells)
    with TemporaryDirectory() as folder:
        Path(folder, "cone.inp").write_text(text)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        started = time.monotonic()
        done = subprocess.run(["ccx", "cone"], cwd=folder, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        rows = loads(Path(folder, "cone.dat").read_text())
        if done.returncode or not len(rows) or rows[-1, 0] < 1 - 1e-9:
            sys.exit(
                f"{cells} elements: ccx ended at {rows[-1, 0] if len(rows) else 0:.3g} of the depth\n"
                + done.stdout[-1500:]
            )
    plane = YOUNG / (1 - POISSON**2)
    load = np.abs(rows[:, 1])
    freed = rows[:, 0] * depth + BASE * load / (plane * HEIGHT)
    late = rows[:, 0] > 0.5
    # the curvature of the second half, in which contact goes from node to node
    curvature = float(np.sum(load[late] * freed[late] ** 2) / np.sum(freed[late] ** 4)) / YIELD
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"| {cells:g} | {count} | {curvature:.2f} | {100 * (curvature / EXACT - 1):+.1f} | {seconds:.1f} | "
        f"{time.monotonic() - started:.1f} |",
        flush=True,
    )


print("| elements a radius | elements | C/Y | error [%] | processor [s] | clock [s] |")
print("|---|---|---|---|---|---|")
for one in map(float, sys.argv[1:]):
    press(one)
