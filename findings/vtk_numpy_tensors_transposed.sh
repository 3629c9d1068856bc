#!/bin/sh
# VTK 9.7.2: the Python view of an array of nine components is the transposed matrix of what VTK's own filters write.
#
# Who is bitten: who takes a deformation or velocity gradient, or the half edges of particles, from a data set in a
#       Programmable Filter of ParaView or by vtkmodules.numpy_interface, and multiplies it by a vector.
# A good guess: nine components are a matrix row by row, as vtkGradientFilter writes it (component 3 i + j is the
#       derivative of velocity i along axis j), so `gradient @ step` is the change of the velocity along a step.
# Seen: simple shear, v = (y, 0, 0). vtkGradientFilter writes 0 1 0 0 0 0 0 0 0. numpy_interface gives it with the shape
#       (n, 3, 3) and the 1 in row 1, column 0: the change of v along y comes out as 0, and 1 for that of v_y along x.
#       vtk_to_numpy and PyVista give nine numbers a row, in the order of the file. Symmetric tensors show nothing.
# Instead: transpose what numpy_interface gives, or use vtk_to_numpy(...).reshape(-1, 3, 3).
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2 numpy==2.4.6
cat >"$dir/shear.py" <<'END'
import sys

import numpy
import vtk
from vtkmodules.numpy_interface import dataset_adapter
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

grid = vtk.vtkImageData()
grid.SetDimensions(3, 3, 3)
places = numpy.array([grid.GetPoint(i) for i in range(27)])
velocity = numpy_to_vtk(numpy.c_[places[:, 1], numpy.zeros((27, 2))], deep=1)
velocity.SetName("velocity")
grid.GetPointData().AddArray(velocity)
gradient = vtk.vtkGradientFilter()
gradient.SetInputData(grid)
gradient.SetInputScalars(vtk.vtkDataObject.FIELD_ASSOCIATION_POINTS, "velocity")
gradient.SetResultArrayName("gradient")
gradient.Update()
written = vtk_to_numpy(gradient.GetOutput().GetPointData().GetArray("gradient"))[13].reshape(3, 3)
viewed = numpy.asarray(dataset_adapter.WrapDataObject(gradient.GetOutput()).PointData["gradient"])[13]
along_y = numpy.array([0.0, 1.0, 0.0])
print("VTK", vtk.VTK_VERSION)
print("written:", written.tolist(), "change of v along y:", (written @ along_y).tolist())
print("numpy_interface:", viewed.tolist(), "change of v along y:", (viewed @ along_y).tolist())
as_said = (written @ along_y == [1, 0, 0]).all() and (viewed @ along_y == 0).all() and (viewed == written.T).all()
sys.exit(0 if as_said else "it is not transposed any more")
END
"$dir/venv/bin/python" "$dir/shear.py"
