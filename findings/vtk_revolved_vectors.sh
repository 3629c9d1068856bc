#!/bin/sh
# VTK 9.7.2: revolving a section turns its points, and none of its vectors and tensors.
#
# Who is bitten: who shows an axisymmetric result in three dimensions by ParaView's Rotational Extrusion (PyVista's
#       extrude_rotate) and puts arrows on it, warps it by its displacement, or takes a component of a stress.
# A good guess: a filter that turns the points of a section about an axis turns what is given there along with them, at
#       least the vectors; a radial displacement stays radial.
# Seen: a section whose displacement is radial, 1 m at a radius of 1 m. Revolved in quarters, the point at (0, 1) still has
#       the displacement (1, 0, 0), along the circumference, that at (-1, 0) points inwards. Warped by it, the body is
#       shifted along x and not widened: its width across x stays 2 m (4 m is right).
# Instead: warp the section first and revolve it afterwards; or compute the components from the angle of each point.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2 pyvista==0.49.1 numpy==2.4.6
cat >"$dir/revolved.py" <<'END'
import sys

import numpy
import pyvista

section = pyvista.Plane(center=(0.5, 0, 0.5), direction=(0, 1, 0), i_resolution=2, j_resolution=2)
section.clear_data()
section["displacement"] = section.points * [1, 0, 0]
section.set_active_vectors("displacement")
body = section.extrude_rotate(resolution=4, angle=360.0, capping=False)
print("VTK", ".".join(map(str, pyvista.vtk_version_info[:3])), "PyVista", pyvista.__version__)
for place in (1, 0, 1), (0, 1, 1), (-1, 0, 1), (0, -1, 1):
    point = body.find_closest_point(place)
    print(f"at {body.points[point].round(9) + 0.0}: displacement {body['displacement'][point]} m")
quarter = body["displacement"][body.find_closest_point((0, 1, 1))]
warped, first = (float(numpy.ptp(mesh.points[:, 0])) for mesh in (body.warp_by_vector("displacement"), body))
right = float(numpy.ptp(section.warp_by_vector("displacement").extrude_rotate(resolution=4, capping=False).points[:, 0]))
print(f"width of the body: {first:g} m, warped: {warped:g} m, section warped, then revolved: {right:g} m")
as_said = numpy.allclose(quarter, [1, 0, 0]) and numpy.isclose(warped, 2) and numpy.isclose(right, 4)
sys.exit(0 if as_said else "vectors are turned now")
END
"$dir/venv/bin/python" "$dir/revolved.py"
