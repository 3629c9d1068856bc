#!/bin/sh
# Gmsh 4.15.2: a STEP file in metres is read a thousand times larger; its coordinates are always millimetres.
#
# Who is bitten: who takes a die or a tip from a CAD file through Gmsh to STL, or meshes a part for a code in SI units.
# A good guess: coordinates come as they are in the file (as those of BREP, STL and .geo do), or, since a STEP file states its
#       unit, as metres; a file that is written and read again by Gmsh is the same, so the unit is kept.
# Seen: a box of 1 x 2 x 3 written by Gmsh states millimetres. The same file with the unit of metres in its place is read
#       as 1000 x 2000 x 3000, by importShapes and by merge, without a word. With Geometry.OCCTargetUnit='M' it is read as
#       1 x 2 x 3, and the file in millimetres as .001 x .002 x .003; files are written in millimetres then as well.
# Instead: set Geometry.OCCTargetUnit to 'M' before reading, and check one length.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check gmsh==4.15.2
cat >"$dir/units.py" <<'END'
import sys

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.add("box")
gmsh.model.occ.addBox(0, 0, 0, 1, 2, 3)
gmsh.model.occ.synchronize()
gmsh.write("millimetres.step")
text = open("millimetres.step").read()
unit = "SI_UNIT(.MILLI.,.METRE.)"
open("metres.step", "w").write(text.replace(unit, "SI_UNIT($,.METRE.)"))


def length(name, read):
    gmsh.model.add(name)
    read(name)
    gmsh.model.occ.synchronize()
    return gmsh.model.getBoundingBox(-1, -1)[5]


print("Gmsh", gmsh.__version__, "- third edge of the box, 3 in the file:")
found = [unit in text]
for target, expected in (("", (3, 3000)), ("M", (0.003, 3))):
    gmsh.option.setString("Geometry.OCCTargetUnit", target)
    for name, value in zip(("millimetres.step", "metres.step"), expected):
        for read in gmsh.model.occ.importShapes, gmsh.merge:
            seen = length(name, read)
            print(f"target unit {target!r}: {name} by {read.__name__}: {seen:.6g}")
            found.append(abs(seen / value - 1) < 1e-3)
gmsh.finalize()
sys.exit(0 if all(found) else "units are treated otherwise now")
END
cd "$dir"
status=0
"$dir/venv/bin/python" units.py >said || status=$?
grep '^Gmsh\|^target' said # Open CASCADE prints a frame around what it writes
exit $status
