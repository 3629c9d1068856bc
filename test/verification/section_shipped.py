"""Every shipped scene that has a section: what `gimp3d --section` writes of it runs, and its section is of the
same body. usage: section_shipped.py (in an empty directory; GIMP3D is the program)"""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
from checks import check, finish, require
from run_scene import ROOT
from gimp3d.run_data import History, read_namelists

SHARE = 0.01  # of the time
# scenes of input/ that have one
KNOWN = {"bar", "billet", "cone_cylinder", "demo", "flat_cylinder", "hertz", "press_fit", "rolling", "sand"}
KNOWN |= {"spall", "sphere", "spheres", "taylor", "taylor_damage"}


def part_of(case):
    """The part of the whole body that a scene in 3D models; in plane strain its metres of width."""
    grid = case["grid"][0]
    sides = [side.lower() for side in grid["boundary"]]
    if sides[2] == sides[3] == "symmetry":
        return grid["upper"][1] - grid["lower"][1]
    return 0.5 ** [sides[0], sides[2]].count("symmetry")


def mass_of(text, name):
    shorter = lambda found: f"{found[1]}{SHARE * float(found[2])!r}"
    text = re.sub(r"(end_time\s*=\s*)([^\s,/]+)", shorter, text)
    text = re.sub(r"directory\s*=\s*'[^']*'", f"directory='{name}'", text)
    text = re.sub(r"&(checkpoint|restart)\b[^/]*/", "", text)
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True)
    require(f"{name}: it runs {done.stderr.strip()[-200:]}", done.returncode == 0)
    return History(Path(name) / "energy.dat")["mass"][0] if done.returncode == 0 else np.nan


found = set()
for path in sorted([*(ROOT / "input").glob("*.nml"), *(ROOT / "input/tutorial").glob("*.nml")]):
    done = subprocess.run([os.environ["GIMP3D"], "--section", path], capture_output=True, text=True)
    said = done.stderr.strip().splitlines()
    if done.returncode:
        require(f"{path.name}: one sentence, status 2", done.returncode == 2 and len(said) == 1)
        continue
    found.add(path.stem)
    flat = mass_of(done.stdout, f"{path.stem}_section")
    if "&pressure" in done.stdout:  # a patch goes on along y, and the case that was used says so
        mass_of(Path(f"{path.stem}_section/case.nml").read_text(), f"{path.stem}_again")
    case = read_namelists(path.read_text())
    if path.stem in ("hertz", "billet", "spheres", "sand"):  # cheap in 3D too
        own = mass_of(path.read_text(), path.stem) / part_of(case)
        check(f"{path.stem}: mass of the whole body over that of the scene, off 1", flat / own - 1, 0.03)
require(f"these have a section: {' '.join(sorted(KNOWN - found)) or 'all'}", KNOWN <= found)
print(f"   {len(found)} shipped scenes have a section: {', '.join(sorted(found))}")
finish()
