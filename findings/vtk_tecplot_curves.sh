#!/bin/sh
# VTK 9.7.2: the Tecplot reader shows nothing of a curve whose points lie along I, and all of one whose points lie along J.
#
# Who is bitten: who writes histories, profiles or outlines as Tecplot zones of I points (the usual form) and opens
#       them in VTK, PyVista or ParaView.
# A good guess: ZONE I=5, DATAPACKING=POINT gives a block of five points.
# Seen: no block at all, and no message; I=1, J=5 gives the five points; DATAPACKING=BLOCK gives them for I=5 too.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check vtk==9.7.2
cat >"$dir/try.py" <<'END'
import sys

import vtk

print("VTK", vtk.vtkVersion.GetVTKVersion())
x = range(5)
rows = "".join(f"{i} 0 0 {10 * i}\n" for i in x)
block = "".join(" ".join(str(f(i)) for i in x) + "\n" for f in (int, lambda i: 0, lambda i: 0, lambda i: 10 * i))
cases = [
    ("I=5, J=1, K=1, DATAPACKING=POINT", rows, []),
    ("I=5, DATAPACKING=POINT", rows, []),
    ("I=1, J=5, K=1, DATAPACKING=POINT", rows, [5]),
    ("I=5, J=1, K=1, DATAPACKING=BLOCK", block, [5]),
]
same = True
for zone, data, expected in cases:
    with open("curve.dat", "w") as file:
        file.write(f'TITLE="curve"\nVARIABLES="X" "Y" "Z" "load"\nZONE T="a", {zone}\n{data}')
    reader = vtk.vtkTecplotReader()
    reader.SetFileName("curve.dat")
    reader.Update()
    out = reader.GetOutput()
    blocks = [out.GetBlock(k).GetNumberOfPoints() for k in range(out.GetNumberOfBlocks()) if out.GetBlock(k)]
    print(f"ZONE {zone}: points of each block {blocks}")
    same = same and blocks == expected
sys.exit(0 if same else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
