#!/bin/sh
# trimesh 5.2.0: a surface of nanometres in metres loses its corners when it is loaded.
#
# Who is bitten: nanoindentation and AFM, where tips of 10 nm radius are kept in metres as simulation codes want them.
# A good guess: loading an STL gives the triangles of the file, whatever the unit.
# Seen: corners nearer than 1e-8 (in the file's unit, an absolute number) are taken for one. A closed sphere of 10 nm
#       loses 616 of 642 corners, is not watertight and has 63 % of its volume; one of 1 nm has a single corner and no
#       volume. No warning names the cause. At 100 nm nothing is lost.
# Instead: process=False (checked below), or scale to nanometres first.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import numpy as np
import trimesh

np.seterr(all="ignore")
print("trimesh", trimesh.__version__)
expected = {1e-7: (642, True, 0.991), 1e-8: (26, False, 0.626), 1e-9: (1, False, 0.0)}
same = True
for radius, wanted in expected.items():
    trimesh.creation.icosphere(subdivisions=3, radius=radius).export("tip.stl")
    loaded = trimesh.load("tip.stl")
    volume = loaded.volume / (4 / 3 * np.pi * radius**3)
    print(
        f"radius {radius:g} m: {len(loaded.vertices)} corners of 642, {len(loaded.faces)} faces, "
        f"watertight {loaded.is_watertight}, volume {volume:.3f} of the sphere's"
    )
    same = same and (len(loaded.vertices), bool(loaded.is_watertight)) == wanted[:2]
    same = same and abs(volume - wanted[2]) < 2e-3
    raw = trimesh.load("tip.stl", process=False)
    same = same and abs(raw.volume / (4 / 3 * np.pi * radius**3) - 0.991) < 2e-3
sys.exit(0 if same else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
