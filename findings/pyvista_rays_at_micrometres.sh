#!/bin/sh
# PyVista 0.49.1 (VTK 9.7.2): on a surface of micrometres in metres a ray hits a ball 15 times, and half a
# ball has 6 % too little volume.
#
# Who is bitten: who takes the height of an imprint, the profile of a tip or a sink-in by rays on a surface in
# metres, or cuts a tip and measures what is left: the tolerances there are lengths (1.2e-7, 1e-6), whatever
# the size of the surface.
# A good guess: the same as for a ball of 1 m, to rounding.
# Seen: `ray_trace` through a ball beside its middle finds 2 points for a radius of 1 and of 1e-3, 4 for 1e-5,
#       15 for 1e-6 (the first 1.1 % of the radius outside), 62 for 1e-9 (13 %).
#       `intersect_with_line(tolerance=0)` finds the two at any size. `clip_closed_surface` leaves half a ball
#       of 2.082 radii cubed, and of 1.957 from 1e-5 down.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyvista==0.49.1 vtk==9.7.2 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import pyvista as pv
import vtk

print("PyVista", pv.__version__, "VTK", vtk.vtkVersion().GetVTKVersion())
rows = []
for radius in 1.0, 1e-3, 1e-5, 1e-6, 1e-9:
    ball = pv.Sphere(radius=radius, theta_resolution=40, phi_resolution=40)
    ray = [-2 * radius, 0.01 * radius, 0.01 * radius], [2 * radius, 0.01 * radius, 0.01 * radius]
    points = ball.ray_trace(*ray)[0]
    strict = ball.intersect_with_line(*ray, tolerance=0.0)[0]
    half = ball.clip_closed_surface("z").volume / radius**3
    outside = float(abs(points[:, 0]).max() / radius - 1)
    rows.append((len(points), len(strict), round(half, 3)))
    print(f"radius {radius:g}: {len(points)} hits, the outermost {100 * outside:.1f} % outside the ball;")
    print(f"   with tolerance 0: {len(strict)}; half the ball: {half:.3f} radii cubed")
scale_free = all(row == rows[0] for row in rows)
two_strict = all(row[1] == 2 for row in rows)
many = rows[0][0] == 2 and rows[3][0] > 10 and rows[4][0] > 40
less = rows[0][2] > 2.08 and rows[3][2] < 1.96
sys.exit(0 if two_strict and many and less and not scale_free else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
