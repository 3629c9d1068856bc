#!/bin/sh
# PyVista 0.49.1 (VTK 9.7.2): a change of units of a mesh changes one of its vector fields, the active one.
#
# Who is bitten: who scales a result from metres to micrometres to plot it, or rotates it to the axes of an instrument, and
#       then reads velocities, forces or displacements from it.
# A good guess: `mesh.scale(1e6)` is about lengths: it changes the points, and no field; or, if displacements are lengths to
#       it, all vectors alike.
# Seen: two equal fields of vectors of length 1. After scale(1e6) the active one has the length 1e6, the other 1; after
#       rotate_z(90) the active one is turned, the other is not, so that two fields of one mesh are in two frames. Tensors
#       (9 components) stay as they are in both, also with transform_all_input_vectors=True.
# Instead: set_active_vectors(None) before it (then no field changes), or transform_all_input_vectors=True for rotations, and
#       tensors by hand.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6
cat >"$dir/scaled.py" <<'END'
import sys

import numpy
import pyvista

mesh = pyvista.ImageData(dimensions=(2, 2, 2)).cast_to_unstructured_grid()
for name in "force", "velocity":
    mesh[name] = numpy.tile([1.0, 0.0, 0.0], (8, 1))
mesh["stress"] = numpy.tile(numpy.diag([1.0, 0.0, 0.0]).ravel(), (8, 1))
mesh.GetPointData().SetActiveTensors("stress")
mesh.set_active_vectors("velocity")
scaled, turned = mesh.scale(1e6), mesh.rotate_z(90)
all_turned = mesh.rotate_z(90, transform_all_input_vectors=True)
mesh.set_active_vectors(None)
left = mesh.scale(1e6)
print("PyVista", pyvista.__version__)
for name in "force", "velocity", "stress":
    print(f"{name}: scaled {scaled[name][0]}, turned {turned[name][0].round(9) + 0.0},",
          f"all turned {all_turned[name][0].round(9) + 0.0}, none active, scaled {left[name][0]}")
as_said = (
    numpy.allclose(scaled["velocity"][0], [1e6, 0, 0])
    and numpy.allclose(scaled["force"][0], [1, 0, 0])
    and numpy.allclose(turned["velocity"][0], [0, 1, 0])
    and numpy.allclose(turned["force"][0], [1, 0, 0])
    and numpy.allclose(all_turned["force"][0], [0, 1, 0])
    and numpy.allclose(all_turned["stress"], mesh["stress"])
    and numpy.allclose(left["velocity"][0], [1, 0, 0])
)
sys.exit(0 if as_said else "it treats vectors otherwise now")
END
"$dir/venv/bin/python" "$dir/scaled.py"
