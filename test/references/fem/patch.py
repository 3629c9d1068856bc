"""The thesis's E5 by finite elements of another program, CalculiX (`apt-get install calculix-ccx`): a quarter of a
block of 8 x 8 x 7 mm of metal that yields and hardens, under a pressure on 2 x 2 mm of its top. Elements of 20 nodes
with reduced integration (C3D20R), large strains, the pressure follows. Stresses and plastic strain are the mean of the
element whose middle is (0.25, 0.25, 6.75) mm.

usage: patch.py CELL OUT.csv     CELL: edge of the elements below the patch in mm, 1/2, 1/6 or 1/10 (0.5/odd)
"""

import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

YOUNG, POISSON, YIELD, HARDENING = 70e3, 0.33, 60.0, 3.5e3  # MPa
PRESSURE, STEPS = 400.0, 20  # MPa, increments
WIDTH, HEIGHT, PATCH, POINT = 4.0, 7.0, 1.0, 0.25  # mm
GROWTH = 1.4


def lines(cell, length):
    """Planes of the mesh: apart by `cell` as far as twice the point, by half as much again up to the edge of the
    patch, then wider and wider."""
    count = max(1, round((PATCH - 2 * POINT) / (1.5 * cell)))
    at = [
        *np.linspace(0, 2 * POINT, round(2 * POINT / cell) + 1),
        *np.linspace(2 * POINT, PATCH, count + 1)[1:],
    ]
    steps, width = [], at[-1] - at[-2]
    while PATCH + sum(steps) < length:
        width = min(GROWTH * width, 1.0)
        steps.append(width)
    return np.array(at + list(PATCH + np.cumsum(steps) * (length - PATCH) / sum(steps)))


def mesh(cell):
    """Nodes (number: place), elements (20 nodes each), the probe's element, the elements under the patch."""
    x, depth = lines(cell, WIDTH), lines(cell, HEIGHT)
    halves = lambda at: np.sort(np.concatenate([at, (at[1:] + at[:-1]) / 2]))
    xs, zs = halves(x), np.sort(HEIGHT - halves(depth))
    number, nodes = {}, []

    def node(i, j, k):
        if (i, j, k) not in number:
            number[i, j, k] = len(nodes) + 1
            nodes.append((xs[i], xs[j], zs[k]))
        return number[i, j, k]

    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    places = corners + [tuple((a + b) // 2 for a, b in zip(corners[p], corners[q])) for p, q in pairs]
    elements, probe, loaded = [], 0, []
    for k in range(0, len(zs) - 2, 2):
        for j in range(0, len(xs) - 2, 2):
            for i in range(0, len(xs) - 2, 2):
                elements.append([node(i + a, j + b, k + c) for a, b, c in places])
                middle = np.array([xs[i + 1], xs[j + 1], zs[k + 1]])
                if np.abs(middle - [POINT, POINT, HEIGHT - POINT]).max() < 1e-9:
                    probe = len(elements)
                if k == len(zs) - 3 and max(middle[:2]) < PATCH:
                    loaded.append(len(elements))
    if not probe:
        sys.exit(f"no element has its middle at {POINT} mm: CELL is 0.5 mm over an odd number")
    return np.array(nodes), elements, probe, loaded


def deck(nodes, elements, probe, loaded):
    text = ["*NODE"] + [f"{n}, {x:.12g}, {y:.12g}, {z:.12g}" for n, (x, y, z) in enumerate(nodes, 1)]
    text.append("*ELEMENT, TYPE=C3D20R, ELSET=ALL")
    for n, element in enumerate(elements, 1):
        text += [f"{n}, " + ", ".join(map(str, element[:14])) + ",", ", ".join(map(str, element[14:]))]
    text += ["*ELSET, ELSET=PROBE", str(probe), "*ELSET, ELSET=LOADED"] + [str(n) for n in loaded]
    text += ["*MATERIAL, NAME=METAL", "*ELASTIC", f"{YOUNG}, {POISSON}"]
    text += [
        "*PLASTIC",
        f"{YIELD}, 0",
        f"{YIELD + HARDENING}, 1",
        "*SOLID SECTION, ELSET=ALL, MATERIAL=METAL",
    ]
    text.append("*BOUNDARY")
    for axis, side in enumerate((nodes[:, 0], nodes[:, 1], nodes[:, 2]), 1):
        text += [f"{n}, {axis}, {axis}" for n in np.flatnonzero(side < 1e-9) + 1]
    text += [f"*STEP, NLGEOM, INC={10 * STEPS}", "*STATIC", f"{1 / STEPS}, 1., 1e-5, {1 / STEPS}"]
    text += ["*DLOAD", f"LOADED, P2, {PRESSURE}", "*EL PRINT, ELSET=PROBE", "S, PEEQ", "*END STEP"]
    return "\n".join(text) + "\n"


def solve(cell):
    """Rows of the pressure, von Mises, szz, sxx (MPa) and the equivalent plastic strain."""
    with TemporaryDirectory() as directory:
        Path(directory, "patch.inp").write_text(deck(*mesh(cell)))
        subprocess.run(["ccx", "-i", "patch"], cwd=directory, check=True, stdout=subprocess.DEVNULL)
        said = Path(directory, "patch.dat").read_text().splitlines()
    values, now = {}, None
    for line in said:
        words = line.split()
        if "for set PROBE" in line:
            now = (float(words[-1]), "peeq" if "plastic" in line else "stress")
            values[now] = []
        elif words and now:
            values[now].append([float(word) for word in words[2:]])
    rows = [(0.0,) * 5]
    for time in sorted({time for time, _ in values}):
        stress = np.array(values[time, "stress"])
        sxx, syy, szz, sxy, sxz, syz = stress[:, :6].T
        mises = np.sqrt(
            ((sxx - syy) ** 2 + (syy - szz) ** 2 + (szz - sxx) ** 2) / 2 + 3 * (sxy**2 + sxz**2 + syz**2)
        )
        strain = np.array(values[time, "peeq"])[:, 0]
        rows.append((PRESSURE * time, mises.mean(), szz.mean(), sxx.mean(), strain.mean()))
    return np.array(rows)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    np.savetxt(
        sys.argv[2],
        solve(float(Fraction(sys.argv[1]))),
        delimiter=",",
        fmt="%.8g",
        header="pressure_MPa,von_mises_MPa,stress_zz_MPa,stress_xx_MPa,equivalent_plastic_strain",
        comments="",
    )
