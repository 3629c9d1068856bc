#!/bin/sh
# CalculiX 2.20 (Debian 12): in axisymmetric models, contact of surfaces misses what lies under a master face
# that begins on the axis.
#
# Who is bitten: who presses an axisymmetric punch, cone or plate that reaches the axis, which nearly all do.
# A good guess: both kinds of contact give the load of plane strain times the area, up to the discretisation,
#       for any mesh of the rigid plate; when no contact is found, something is said.
# Seen: a plate of one element, from the axis outwards, pressed on a column (elastic, no lateral strain) to a
#       stress of -1. TYPE=SURFACE TO SURFACE: force 0, status 0, no warning about contact; with two elements
#       of the plate a face on the axis carries nothing and 9 % of the load are missing, with ten .004 %. A
#       plate that begins at 1e-4 of the radius carries the whole load. The same meshes in plane strain (CPE4),
#       and TYPE=NODE TO SURFACE, carry it too. A column of one element finds no contact either.
# Instead: begin the master surface a little outside the axis, refine it there, compare with NODE TO SURFACE.
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=calculix-ccx,python3-minimal bookworm "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/axis.py" <<'END'
import math
import re
import subprocess
import sys


def strip(nodes, elements, first, radii, lower, upper, section):
    """A row of elements from radius to radius; numbers of the lower and upper nodes, and of the elements."""
    below = [first + 2 * n for n in range(len(radii))]
    for node, r in zip(below, radii):
        nodes += [f"{node}, {r!r}, {lower}", f"{node + 1}, {r!r}, {upper}"]
    made = [first + n for n in range(len(radii) - 1)]
    elements.append(f"*ELEMENT, TYPE={section[0]}, ELSET={section[1]}")
    for one, a, b in zip(made, below, below[1:]):
        elements.append(f"{one}, {a}, {b}, {b + 1}, {a + 1}")
    return below, made


def load(element, kind, column_faces, plate_faces, start):
    """Reaction of the floor over modulus * strain * area."""
    nodes, elements = ["*NODE, NSET=ALL"], []
    radii = [n / column_faces for n in range(column_faces + 1)]
    floor, column = strip(nodes, elements, 1, radii, -1, 0, (element, "COLUMN"))
    radii = [max(start, 1.2 * n / plate_faces) for n in range(plate_faces + 1)]
    under, plate = strip(nodes, elements, 101, radii, 0, 0.2, (element, "PLATE"))
    text = nodes + elements + ["*NSET, NSET=FLOOR"] + [f"{n}" for n in floor]
    text += ["*NSET, NSET=HEAD"] + [f"{n}, {n + 1}" for n in under]
    text += ["*SURFACE, NAME=TOP"] + [f"{n}, S3" for n in column]
    text += ["*SURFACE, NAME=FACE"] + [f"{n}, S1" for n in plate]
    text += [
        "*MATERIAL, NAME=M", "*ELASTIC", "1000., 0.", "*SOLID SECTION, ELSET=COLUMN, MATERIAL=M",
        "*SOLID SECTION, ELSET=PLATE, MATERIAL=M", "*SURFACE INTERACTION, NAME=SMOOTH",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", "1e6",
        f"*CONTACT PAIR, INTERACTION=SMOOTH, TYPE={kind}", "TOP, FACE",
        "*BOUNDARY", "FLOOR, 2", "HEAD, 1", f"{floor[0]}, 1", f"{floor[0] + 1}, 1",
        "*STEP, NLGEOM", "*STATIC", "1., 1.", "*BOUNDARY", "HEAD, 2, 2, -0.001",
        "*NODE PRINT, NSET=FLOOR, TOTALS=ONLY", "RF", "*END STEP", "",
    ]  # fmt: skip
    open("axis.inp", "w").write("\n".join(text))
    done = subprocess.run(["ccx", "axis"], capture_output=True, text=True)
    force = float(re.search(r"total force.*\n\s*\n\s*\S+\s+(\S+)", open("axis.dat").read())[1])
    whole = math.pi / 180 if element == "CAX4" else 1.0  # a sector of 2 degrees is printed
    return done.returncode, force / whole, "no contact" in done.stdout.lower()


expected = {
    ("CAX4", "SURFACE TO SURFACE", 10, 1, 0.0): 0.0,
    ("CAX4", "SURFACE TO SURFACE", 10, 2, 0.0): 0.914,
    ("CAX4", "SURFACE TO SURFACE", 10, 10, 0.0): 0.997,
    ("CAX4", "SURFACE TO SURFACE", 10, 1, 1e-4): 0.997,
    ("CAX4", "SURFACE TO SURFACE", 1, 4, 1e-4): 0.0,
    ("CAX4", "NODE TO SURFACE", 10, 1, 0.0): 0.997,
    ("CPE4", "SURFACE TO SURFACE", 10, 1, 0.0): 0.997,
}
print("element, contact, faces of the column and the plate, inner radius of the plate: status, load")
good = True
for case, value in expected.items():
    status, found, said = load(*case)
    print(*case, ":", status, f"{found:.4f}", "(says that there is no contact)" if said else "")
    good &= status == 0 and abs(found - value) < 2e-3 and not said
sys.exit(0 if good else "contact on the axis is treated otherwise now")
END
version=$(chroot "$dir/root" dpkg-query -W -f "\${Version}" calculix-ccx)
echo "CalculiX $version"
[ "$version" = 2.20-1 ] || { echo 'pinned to 2.20-1, and Debian 12 has another now'; exit 1; }
chroot "$dir/root" sh -c 'cd /tmp && OMP_NUM_THREADS=1 python3 axis.py'
