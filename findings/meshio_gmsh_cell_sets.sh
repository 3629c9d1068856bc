#!/bin/sh
# meshio 5.3.5: a mesh that Gmsh 4.15.2 writes by default cannot be converted: the tags of bounding entities are
# taken for indices of cells.
#
# Who is bitten: who brings a .msh (4.1) without physical groups to VTK or PyVista: pyvista.read('box.msh'),
#       pyvista.from_meshio, Mesh.cell_sets_to_data. Gmsh writes no physical groups unless they are asked for.
# A good guess: meshio.read gives no error, and cell_sets hold indices of cells, as those of physical groups do, so
#       they can be converted to data.
# Seen: meshio.read puts the signed tags of the entities that bound each entity (for a box: -1 2 -3 4 -5 6) into
#       cell_sets['gmsh:bounding_entities'], where indices of cells belong. The conversion ends in "IndexError: index 6
#       is out of bounds for axis 0 with size 6", or, where the tags are small enough, marks cells that
#       have nothing to do with them: of the tetrahedra alone those of numbers 2, 4, 6 and -1, -3, -5.
# Instead: mesh.cell_sets = {} after meshio.read; or a physical group in Gmsh.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2 meshio==5.3.5 pyvista==0.49.1 vtk==9.7.2 \
   numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import gmsh
import meshio
import numpy
import pyvista

print("meshio", meshio.__version__, "Gmsh", gmsh.__version__, "PyVista", pyvista.__version__)
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
gmsh.model.occ.synchronize()
gmsh.model.mesh.generate(3)
gmsh.write("box.msh")
gmsh.finalize()


def error_of(convert):
    try:
        convert()
    except IndexError as error:
        return f"IndexError: {error}"
    return "no error"


mesh = meshio.read("box.msh")
bounding = mesh.cell_sets["gmsh:bounding_entities"]
print("cell_sets:", list(mesh.cell_sets), "; of the tetrahedra:", [int(n) for n in bounding[-1]])
found = {
    "cell_sets_to_data": error_of(mesh.cell_sets_to_data),
    "pyvista.read": error_of(lambda: pyvista.read("box.msh")),
    "pyvista.from_meshio": error_of(lambda: pyvista.from_meshio(meshio.read("box.msh"))),
}
for name, error in found.items():
    print(f"{name}: {error}")
alone = meshio.read("box.msh")
sets = {"gmsh:bounding_entities": [bounding[-1]]}
alone = meshio.Mesh(alone.points, alone.cells[-1:], cell_sets=sets)
alone.cell_sets_to_data()
data = numpy.concatenate(alone.cell_data["gmsh:bounding_entities"])
marked = sorted(int(n) for n in numpy.flatnonzero(data == 0))
print(f"tetrahedra alone, {len(data)} cells: no error; marked cells {marked}")
right = meshio.read("box.msh")
right.cell_sets = {}
count = pyvista.from_meshio(right).n_cells
print(f"without cell_sets: {count} cells")
end = len(data)
seen = (
    all(error.startswith("IndexError: index 6 is out of bounds") for error in found.values())
    and sorted(bounding[-1]) == [-5, -3, -1, 2, 4, 6]
    and marked == [2, 4, 6, end - 5, end - 3, end - 1]
    and count == sum(len(cells.data) for cells in right.cells)
)
print("as described" if seen else "changed")
sys.exit(0 if seen else 1)
END
cd "$dir"
"$dir/venv/bin/python" try.py
