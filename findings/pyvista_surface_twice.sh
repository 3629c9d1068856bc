#!/bin/sh
# PyVista 0.49.1 (VTK 9.7.2): `extract_surface` of a volume mesh that stores the triangles of its surface too gives
# each of them twice.
#
# Who is bitten: who makes an STL of a mesh by Gmsh, meshio or a finite-element program for a contact body, a print or
#       a volume: these store boundary triangles beside the tetrahedra, to name sides and loads.
# A good guess: the outer surface of the body, once: closed, with two triangles at each edge.
# Seen: a unit cube of six tetrahedra with the twelve triangles of its surface: 24 triangles in 12 pairs of the same
#       corners; each edge has four (is_manifold is False, n_open_edges is 18, all edges), and the volume is 2 in
#       place of 1. No warning. Each algorithm of extract_surface does so. It is what VTK's filter is told to do:
#       cells of two dimensions are passed on, and faces of cells are added.
# Instead: keep the cells of three dimensions first:
#       d = numpy.array([c.dimension for c in g.cell]); g.extract_cells(d == d.max()).extract_surface()
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys
import warnings
from itertools import permutations

import numpy
import pyvista

warnings.simplefilter("ignore")
print("PyVista", pyvista.__version__, "VTK", ".".join(map(str, pyvista.vtk_version_info)))
points = numpy.array([[n & 1, n >> 1 & 1, n >> 2] for n in range(8)], dtype=float)
cells = [[0, 1 << a, (1 << a) + (1 << b), 7] for a, b, _ in permutations(range(3))]
cells = numpy.array([c if numpy.linalg.det(points[c[1:]] - points[c[0]]) > 0 else [*c[:2], c[3], c[2]] for c in cells])
faces = [c[list(one)] for c in cells for one in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))]
names = [tuple(sorted(face)) for face in faces]
skin = numpy.array([face for face, name in zip(faces, names) if names.count(name) == 1])


def measure(grid, **options):
    surface = grid.extract_surface(**options)
    triangles = surface.faces.reshape(-1, 4)[:, 1:]
    corners = numpy.round(surface.points[triangles], 9).tolist()
    different = {tuple(sorted(map(tuple, three))) for three in corners}
    return len(triangles), len(different), surface.is_manifold, surface.n_open_edges, round(float(surface.volume), 6)


alone = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: cells}, points)
both = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: cells, pyvista.CellType.TRIANGLE: skin}, points)
print("triangles, different ones, manifold, open edges, volume")
right = measure(alone)
print("tetrahedra alone:", right)
seen = right[:4] == (12, 12, True, 0) and right[4] == 1
for algorithm in "default", "dataset_surface", "geometry":
    found = measure(both, **({} if algorithm == "default" else {"algorithm": algorithm}))
    print(f"with the triangles, algorithm {algorithm}:", found)
    seen = seen and found == (24, 12, False, 18, 2.0)
d = numpy.array([c.dimension for c in both.cell])
chosen = measure(both.extract_cells(d == d.max()))
print("cells of three dimensions chosen:", chosen)
seen = seen and chosen == right
print("as described" if seen else "changed")
sys.exit(0 if seen else 1)
END
cd "$dir"
"$dir/venv/bin/python" try.py
