#!/bin/sh
# meshio 5.3.5: of an Abaqus deck with several parts the nodes of the last part stand for those of all parts.
#
# Who is bitten: who takes a die, a tip or a billet from an assembly that Abaqus/CAE has written (each *Part numbers
# its nodes from 1), to mesh, measure or convert it.
# A good guess: both parts, each at the place of its *Instance; or an error that parts are not supported.
# Seen: no error or warning. A tetrahedron with edges of 1 and one with edges of 2, ten lengths apart, become two
#       cells on the four nodes of the second, at the origin: a volume of 8/3 in place of 3/2, and an extent of 2
#       in place of 12. A deck without parts, of the same bodies, is read right.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check meshio==5.3.5 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import meshio
import numpy as np


def nodes(first, edge, x):
    places = [(x, 0, 0), (x + edge, 0, 0), (x, edge, 0), (x, 0, edge)]
    return "".join(f"{first + n}, {a}.0, {b}.0, {c}.0\n" for n, (a, b, c) in enumerate(places))


def part(name, edge):
    return f"*Part, name={name}\n*Node\n{nodes(1, edge, 0)}*Element, type=C3D4\n1, 1, 2, 3, 4\n*End Part\n"


def measure(deck):
    with open("deck.inp", "w") as file:
        file.write(deck)
    mesh = meshio.read("deck.inp")
    corners = np.concatenate([mesh.points[cells.data] for cells in mesh.cells])
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6
    return len(mesh.points), len(corners), round(float(volume), 4), float(np.ptp(corners[..., 0]))


print("meshio", meshio.__version__)
parts = measure(
    "*Heading\n" + part("small", 1) + part("large", 2) + "*Assembly, name=both\n"
    "*Instance, name=small-1, part=small\n*End Instance\n"
    "*Instance, name=large-1, part=large\n10.0, 0.0, 0.0\n*End Instance\n*End Assembly\n"
)
flat = measure(
    "*Heading\n*Node\n" + nodes(1, 1, 0) + nodes(5, 2, 10)
    + "*Element, type=C3D4\n1, 1, 2, 3, 4\n2, 5, 6, 7, 8\n"
)
print("points, cells, volume, extent along x; two parts:", parts)
print("                                       no parts: ", flat)
right, seen = (8, 2, 1.5, 12.0), (4, 2, 2.6667, 2.0)
sys.exit(0 if flat == right and parts == seen else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
