#!/bin/sh
# Gmsh 4.15.2: a second-order mesh written as STL loses its mid-side nodes; the body shrinks by a tenth, without a word.
#
# Who is bitten: who meshes a ball, a tip or a die with curved (second-order) elements, as finite elements like them, and hands
#       the surface on as STL to a particle code, a slicer or a contact tool.
# A good guess: each 6-node triangle is split into four through its mid-side nodes, as viewers draw it, so that the STL holds
#       what the mesh holds; or the writer says that it cannot.
# Seen: a ball of radius 1 in 114 curved triangles. The second-order mesh holds 4.1834 (exact 4.1888, -.1 %). Its STL has 114
#       facets and holds 3.7758 (-9.9 %), as the first-order mesh's STL. It is watertight, so no later
#       tool complains.
# Instead: for an STL, mesh to first order with elements small enough, or split the 6-node triangles by hand, and compare the
#       volume of what was written with that of the body.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2 trimesh==5.2.0 numpy==2.4.6
cat >"$dir/ball.py" <<'END'
import sys

import gmsh
import numpy
import trimesh

folder = sys.argv[1]
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
volume, written, facets = {}, {}, {}
for order in (1, 2):
    gmsh.clear()
    ball = gmsh.model.occ.addSphere(0, 0, 0, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.6)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.6)
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.model.mesh.generate(3)
    kinds, _, _ = gmsh.model.mesh.getElements(3, ball)
    places, weights = gmsh.model.mesh.getIntegrationPoints(kinds[0], "Gauss4")
    _, determinants, _ = gmsh.model.mesh.getJacobians(kinds[0], places)
    volume[order] = (numpy.reshape(determinants, (-1, len(weights))) @ weights).sum()
    gmsh.write(f"{folder}/ball{order}.stl")
    surface = trimesh.load(f"{folder}/ball{order}.stl")
    written[order], facets[order] = surface.volume, len(surface.faces)
    print(f"order {order}: mesh {volume[order]:.4f}, STL {written[order]:.4f} in {facets[order]} facets,",
          "watertight" if surface.is_watertight else "open")
print(f"exact {4 / 3 * numpy.pi:.4f}")
seen = volume[2] > 4.17 and written[2] < 0.92 * volume[2] and facets[2] == facets[1]
sys.exit(0 if seen else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/ball.py" "$dir"
