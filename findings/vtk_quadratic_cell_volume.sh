#!/bin/sh
# VTK 9.7.2 (PyVista 0.49.1): the volume of a quadratic cell is that of a polyhedron through its nodes, not of the cell.
#
# Who is bitten: who takes masses, mean stresses or filled volumes from finite-element results with 20-node bricks or 10-node
#       tetrahedra (CalculiX C3D20, C3D10, Gmsh order 2) by Cell Size, Integrate Variables or PyVista's `volume`.
# A good guess: quadratic elements are there for curved bodies, and VTK knows their shape functions (it interpolates with them),
#       so the volume is the integral of their Jacobian: for a quarter of a ring 1.2 % off with one brick, 0.08 % with two.
# Seen: a quarter of a ring (radii 1, 2 m, height 1 m; exact 2.35619 m3) in 1, 2, 4 bricks of 20 nodes. Integral of the
#       Jacobian: 2.32843, 2.35436, 2.35608 m3. VTK: 2.12132, 2.29610, 2.34108 m3 (-10, -2.6, -.64 %): the prism over the
#       chords from node to node. Its error falls with the square of the element, as if the elements were linear.
# Instead: integrate the Jacobian at Gauss points (as below, with VTK's own shape functions), or refine until the chords do.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6
cat >"$dir/ring.py" <<'END'
import sys

import numpy
import pyvista
import vtk

# the 20 nodes of VTK_QUADRATIC_HEXAHEDRON on the cube from 0 to 2
corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
nodes = numpy.array(corners + [tuple((numpy.array(corners[a]) + corners[b]) // 2) for a, b in edges])


def quarter_ring(bricks):
    points = []
    for k in range(bricks):
        radius, angle = 1 + nodes[:, 0] / 2, (k + nodes[:, 1] / 2) / bricks * numpy.pi / 2
        points.append(numpy.c_[radius * numpy.cos(angle), radius * numpy.sin(angle), nodes[:, 2] / 2])
    cells = numpy.c_[numpy.full(bricks, 20), numpy.arange(20 * bricks).reshape(bricks, 20)]
    kinds = numpy.full(bricks, vtk.VTK_QUADRATIC_HEXAHEDRON)
    return pyvista.UnstructuredGrid(cells.ravel(), kinds, numpy.vstack(points))


def by_jacobian(grid):
    gauss, weights = numpy.polynomial.legendre.leggauss(4)
    cell, total = vtk.vtkQuadraticHexahedron(), 0.0
    for brick in grid.points.reshape(-1, 20, 3):
        for i, a in enumerate(gauss):
            for j, b in enumerate(gauss):
                for k, c in enumerate(gauss):
                    slopes = [0.0] * 60
                    cell.InterpolationDerivs(((1 + a) / 2, (1 + b) / 2, (1 + c) / 2), slopes)
                    jacobian = numpy.reshape(slopes, (3, 20)) @ brick
                    total += weights[i] * weights[j] * weights[k] / 8 * numpy.linalg.det(jacobian)
    return total


exact, seen = 0.75 * numpy.pi, True
for bricks in (1, 2, 4):
    grid = quarter_ring(bricks)
    true, said = by_jacobian(grid), grid.volume
    print(f"{bricks} bricks: integral of the Jacobian {true:.5f} m3 ({100 * (true / exact - 1):+.2f} %),",
          f"VTK {said:.5f} m3 ({100 * (said / exact - 1):+.2f} %)")
    chords = 3 * bricks * numpy.sin(numpy.pi / (4 * bricks))
    seen = seen and abs(said / chords - 1) < 1e-4 and abs(true / exact - 1) < 0.02
sys.exit(0 if seen else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/ring.py"
