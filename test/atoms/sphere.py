"""Loads at the ends of the holds of input/atoms_sphere.nml against a rigid sphere on the anisotropic half-space
with the potential's moduli. The sphere of the repulsion is larger than the tool by tool_distance. Atoms are 4 to 6
pm inside it, which takes most from the smallest depth."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from checks import finish, require
from gimp3d import anisotropic
from gimp3d.run_data import History

ROOT = Path(__file__).resolve().parents[2]
MODULI = (169.9e9, 122.6e9, 76.21e9)  # of Mishin's copper, as the run prints them
RADIUS = 8e-9 + 0.25 * 0.36149e-9
HOLDS = (3.5e-12, 7e-12, 10.5e-12)

directory = Path(sys.argv[1] if len(sys.argv) > 1 else "out/atoms_sphere")
if len(sys.argv) < 2:
    text = (ROOT / "input/atoms_sphere.nml").read_text()
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True)
    if re.search("LAMMPS cannot be opened|Cu_mishin1.*cannot be read", done.stdout + done.stderr):
        print("  left out, LAMMPS or its potentials are not there: a sphere on atoms")
        finish()
        sys.exit(0)
    require(f"status {done.returncode} {done.stderr[-300:]}", done.returncode == 0)
tool = History(directory / "tool_sphere.dat")
atoms = History(directory / "atoms_atoms.dat")
modulus = anisotropic.sphere_modulus(anisotropic.cubic(*MODULI), (0, 0, 1))
off = []
for end in HOLDS:
    row = np.abs(tool["time"] - end).argmin()  # rows stand some tenths of a picosecond apart
    depth, load = tool["depth"][row], tool["load_z"][row]
    hertz = 4 / 3 * modulus * math.sqrt(RADIUS) * depth**1.5
    off.append(load / hertz - 1)
    print(
        f"  depth {1e9 * depth:.3f} nm: {1e9 * load:.2f} nN, half-space {1e9 * hertz:.2f} nN, "
        f"{100 * off[-1]:+.1f} %; largest force on an atom {atoms['largest_force'][row]:.1e} N"
    )
# 3 % of the half-space, and what waves leave after a hold of 2 ps: 5 % at 0.16 nm, where the load of 20 ps is
# -3.3 % (doc/notebook/atoms.md). At 0.08 nm the atoms' surface and the repulsion take 7 pm of the depth.
require("holds at 0.16 and 0.24 nm within 8 % of the half-space", max(map(abs, off[1:])) < 0.08)
require("hold at 0.08 nm within 9 %", abs(off[0]) < 0.09)
require("atoms rest", atoms["largest_force"][-1] < 1e-3 * tool["load_z"][-1])
require("no defect yet", atoms["defects"][-1] == 0)
finish()
