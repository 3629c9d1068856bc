#!/bin/sh
# meshio 5.3.5, Gmsh 4.15.2, VTK 9.7.2: second-order prisms of Gmsh become wrong cells on the way to VTU.
#
# Who is bitten: who extrudes a film, a plate or a coating in Gmsh with second-order elements, and brings the
# mesh to VTK, ParaView or PyVista by meshio. Volumes, integrals and pictures are wrong; nothing is said.
# A good guess: the nodes are put in VTK's order, as they are for hexahedra of 27 nodes from the same program.
# Seen: a unit cube of four prisms of 18 nodes. Gmsh's own VTK file holds a volume of 1; meshio's VTU, made of
#       Gmsh's MSH, of 0.125: ten of the eighteen nodes stand at places of others. meshio has an order for
#       tetrahedra of 10, hexahedra of 20 and 27, prisms of 15 and pyramids of 13 nodes; it has none for 18.
#       Hexahedra of 27 nodes: 1 by both ways.
# Instead: let Gmsh write VTK itself, and compare the volume of what was read with that of the body.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5 vtk==9.7.2 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import gmsh
import meshio
import numpy as np
import vtk

print("meshio", meshio.__version__, "Gmsh", gmsh.__version__, "VTK", vtk.vtkVersion().GetVTKVersion())


def make(prisms, name):
    """A cube of second order, extruded from a square of triangles or of one quadrilateral."""
    gmsh.clear()
    base = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.occ.extrude([(2, base)], 0, 0, 1, [1], recombine=True)
    gmsh.model.occ.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        gmsh.model.mesh.setTransfiniteCurve(curve, 2)
    if not prisms:
        for _, surface in gmsh.model.getEntities(2):
            gmsh.model.mesh.setTransfiniteSurface(surface)
            gmsh.model.mesh.setRecombine(2, surface)
        gmsh.model.mesh.setTransfiniteVolume(1)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    gmsh.write(name + ".msh")
    gmsh.write(name + ".vtk")


def volume(reader, name):
    reader.SetFileName(name)
    sizes = vtk.vtkCellSizeFilter()
    sizes.SetInputConnection(reader.GetOutputPort())
    sizes.Update()
    values = sizes.GetOutput().GetCellData().GetArray("Volume")
    return sum(values.GetValue(i) for i in range(values.GetNumberOfTuples()))


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
found = {}
for kind in "hexahedron27", "wedge18":
    make(kind == "wedge18", kind)
    own = volume(vtk.vtkUnstructuredGridReader(), kind + ".vtk")
    mesh = meshio.read(kind + ".msh")
    cells = [(block.type, block.data) for block in mesh.cells if block.type == kind]
    meshio.Mesh(mesh.points, cells).write(kind + ".vtu")
    brought = volume(vtk.vtkXMLUnstructuredGridReader(), kind + ".vtu")
    count = sum(len(data) for _, data in cells)
    print(f"{kind}, {count} cells: volume {own:.3f} in Gmsh's VTK file, {brought:.3f} by meshio")
    found[kind] = own, brought
gmsh.finalize()
good = np.allclose(found["hexahedron27"], 1, atol=1e-6) and np.isclose(found["wedge18"][0], 1, atol=1e-6)
seen = good and found["wedge18"][1] < 0.5
print("as described" if seen else "changed")
sys.exit(0 if seen else 1)
END
cd "$dir"
"$dir/venv/bin/python" "$dir/try.py"
