#!/bin/sh
# VTK 9.7.2 (PyVista 0.49.1): of data sets that are put together, a field is dropped where its number type is
# not the same in all.
#
# Who is bitten: who puts the parts of a model together (bodies, blocks, ranks' pieces, time steps of several
#       programs) by Append Datasets of ParaView, vtkAppendFilter, or PyVista's a + b, merge,
#       MultiBlock.combine and append_polydata, where one part has a field in single precision, or 0 and 1 as
#       integers, and the other in double precision.
# A good guess: fields are kept which all inputs have, as is documented, and types are joined to the wider
#       one, as numpy.concatenate does, and vtkAppendPolyData itself with the coordinates.
# Seen: float32 with float64, int64 with float64, int32 with int64: the field is gone, in points and cells,
#       without a message; what asks for it by name next raises KeyError, what goes through the fields that
#       are there (a file, a report) goes on without it. Two of float64: kept. Beside it: vtkAppendFilter
#       takes the type of the first input's points for all, so that a point at x = 3.000000001 in double
#       precision becomes 3 after a part in single precision, and not before it.
# Instead: bring fields to one type first: for m in parts: m["damage"] = m["damage"].astype(float); compare
#       array_names after.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2
cat >"$dir/join.py" <<'END'
import sys

import numpy
import pyvista
import vtk

print("PyVista", pyvista.__version__, "VTK", vtk.vtkVersion.GetVTKVersion())


def part(x, kind, points=numpy.float64):
    corners = numpy.array([[x, 0, 0], [x + 1, 0, 0], [x, 1, 0], [x, 0, 1]], dtype=points)
    mesh = pyvista.UnstructuredGrid(numpy.array([4, 0, 1, 2, 3]), [pyvista.CellType.TETRA], corners)
    mesh.point_data["damage"] = numpy.ones(4, dtype=kind)
    mesh.cell_data["stress"] = numpy.ones(1, dtype=kind)
    return mesh


def by_vtk(one, other):
    join = vtk.vtkAppendFilter()
    join.AddInputData(one)
    join.AddInputData(other)
    join.Update()
    return pyvista.wrap(join.GetOutput())


ways = {
    "vtkAppendFilter": by_vtk,
    "a + b": lambda one, other: one + other,
    "merge": lambda one, other: one.merge(other),
    "combine": lambda one, other: pyvista.MultiBlock([one, other]).combine(),
    "append_polydata": lambda one, other: one.extract_surface(algorithm="dataset_surface").append_polydata(
        other.extract_surface(algorithm="dataset_surface")
    ),
}
same = True
for kinds in (("float64", "float64"), ("float32", "float64"), ("int64", "float64"), ("int32", "int64")):
    kept = {}
    for name, way in ways.items():
        joined = way(part(0.0, kinds[0]), part(3.0, kinds[1]))
        kept[name] = [field for field in ("damage", "stress") if field in joined.array_names]
        same = same and len(kept[name]) == (2 if kinds[0] == kinds[1] else 0)
    said = [f"{name} keeps {', '.join(fields) or 'none'}" for name, fields in kept.items()]
    print(" and ".join(kinds) + ":", "; ".join(said))
single, double = part(0.0, "float64", numpy.float32), part(3.000000001, "float64")
after, before = (by_vtk(*order).bounds[1] for order in ((single, double), (double, single)))
print("right end of the part in double precision, 4.000000001:", end=" ")
print(f"{after:.9f} after a part in float32, {before:.9f} before it")
sys.exit(0 if same and after == 4.0 and before > 4.0 else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/join.py"
