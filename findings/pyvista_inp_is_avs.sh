#!/bin/sh
# PyVista 0.49.1 (VTK 9.7.2): `read` of an Abaqus or CalculiX deck (.inp) gives an empty mesh, without an error.
#
# Who is bitten: who looks at, measures or converts a finite-element mesh with PyVista: .inp is the suffix of decks of Abaqus and
#       CalculiX, and what Gmsh, meshio and FreeCAD write for them.
# A good guess: PyVista lists .inp among the suffixes that it reads, so a deck comes out as a mesh, or ends in an error.
# Seen: the suffix belongs to the reader of AVS UCD files (the same suffix by chance). Two bricks of 1 m3, written by meshio
#       5.3.5: as Abaqus deck 0 points, 0 cells, volume 0, bounds of 1e299, no exception and nothing on standard error; as .vtu
#       12 points, 2 cells, 2 m3. What follows (a volume, a clip, a surface for a contact body) is of nothing. An AVS UCD file
#       of the suffix .inp by meshio is read, but with -2 m3: meshio writes the upper face of a brick first, VTK takes the nodes
#       as they stand, and the bricks are inside out.
# Instead: `meshio convert deck.inp mesh.vtu` (or pyvista.from_meshio(meshio.read('deck.inp'))), and look at n_cells and volume.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2 meshio==5.3.5 numpy==2.4.6
cat >"$dir/deck.py" <<'END'
import sys

import meshio
import numpy
import pyvista

points = numpy.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
bricks = numpy.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
mesh = meshio.Mesh(points, [("hexahedron", bricks)])
mesh.write("deck.inp", file_format="abaqus")
mesh.write("ucd.inp", file_format="avsucd")
mesh.write("mesh.vtu")
read = {name: pyvista.read(name) for name in ("deck.inp", "ucd.inp", "mesh.vtu")}
read["deck.inp by meshio"] = pyvista.from_meshio(meshio.read("deck.inp"))
for name, grid in read.items():
    print(f"{name}: {grid.n_points} points, {grid.n_cells} cells, {grid.volume:.6f} m3")
empty = read.pop("deck.inp")
ok = empty.n_points == 0 and empty.n_cells == 0
exact = {"ucd.inp": -2, "mesh.vtu": 2, "deck.inp by meshio": 2}
ok = ok and all(read[name].n_cells == 2 and abs(read[name].volume - exact[name]) < 1e-9 for name in exact)
sys.exit(0 if ok else "the behaviour has changed")
END
cd "$dir"
venv/bin/python deck.py 2>errors
[ -s errors ] && cat errors && exit 1
echo "nothing on standard error"
