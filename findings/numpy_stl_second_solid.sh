#!/bin/sh
# numpy-stl 4.1.1: Mesh.from_file takes the first solid of a text STL and leaves the others out without a word.
#
# Who is bitten: tips and dies that a CAD program exports as several solids (shank and tip) in one file: the tool that
#       is weighed, measured or converted is not the one of the file.
# A good guess: a mesh of all triangles (as vtk, trimesh and meshio give), or an error.
# Seen: 2 of 4 triangles, no warning; from_multi_file gives both solids.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check numpy-stl==4.1.1 numpy==2.4.6 trimesh==5.2.0
cat >"$dir/try.py" <<'END'
import importlib.metadata
import sys
import warnings

import trimesh
from stl import mesh

warnings.simplefilter("error")
print("numpy-stl", importlib.metadata.version("numpy-stl"))
lines = []
for name, z in (("shank", 5), ("tip", 0)):
    lines.append(f"solid {name}")
    for corners in (((0, 0, z), (1, 0, z), (0, 1, z)), ((0, 0, z), (0, 1, z), (0, 0, z + 1))):
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x} {y} {c}" for x, y, c in corners] + ["endloop", "endfacet"]
    lines.append(f"endsolid {name}")
with open("tool.stl", "w") as file:
    file.write("\n".join(lines) + "\n")
one = len(mesh.Mesh.from_file("tool.stl").vectors)
all_of_them = [len(solid.vectors) for solid in mesh.Mesh.from_multi_file("tool.stl")]
beside = len(trimesh.load("tool.stl", force="mesh").faces)
print(f"file of two solids with two triangles each: from_file {one}, from_multi_file {all_of_them}, trimesh {beside}")
sys.exit(0 if (one, all_of_them, beside) == (2, [2, 2], 4) else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
