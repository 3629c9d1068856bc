"""The load of a quarter model beside that of its section, which `gimp3d --section` writes, on the same cells: in the
mean over the second half of the depth. usage: section_quarter.py SCENE... (in an empty directory; GIMP3D is the
program); scenes: hertz, demo, indenter"""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from checks import check, finish, require
from run_scene import ROOT, replace, run
from gimp3d.indentation import share_of_body
from gimp3d.run_data import History


def ended(text, share):
    """Up to a share of its time."""
    return re.sub(r"end_time=([^\s,/]+)", lambda found: f"end_time={share * float(found[1])!r}", text)


def indenter():
    """A cylinder in place of the block, which no section has; up to the largest depth."""
    text = (ROOT / "input/indenter.nml").read_text()
    box = "shape='box', lower=0,0,0, upper=22.4e-6,22.4e-6,22.4e-6"
    return ended(replace(text, box, "shape='cylinder', center=0,0,0, radius=22.4e-6, height=22.4e-6"), 0.45)


SCENES = {
    "hertz": lambda: (ROOT / "input/hertz.nml").read_text(),
    "demo": lambda: (ROOT / "input/demo.nml").read_text(),
    "indenter": indenter,
}


def curve(name, text):
    """Depth, load of the whole body."""
    text = re.sub(r"&output.*/", f"&output directory='{name}', formats='none', history_every=1e-30 /", text)
    run(text, 1)
    rows = History(next(Path(name).glob("tool_*.dat")))
    return rows["depth"], rows["load_z"] / share_of_body(rows)


def beside(name):
    quarter = SCENES[name]()
    done = subprocess.run([os.environ["GIMP3D"], "--section"], input=quarter, capture_output=True, text=True)
    require(f"{name}: it has a section", done.returncode == 0)
    section = re.sub(r"&output.*?\n/", "&output /", done.stdout, flags=re.S)
    (depth, load), (flat_depth, flat_load) = (
        curve(f"{name}_quarter", quarter),
        curve(f"{name}_section", section),
    )
    late = depth > 0.5 * depth.max()
    other = np.interp(depth[late], flat_depth, flat_load)
    off = 100 * (other / load[late] - 1)
    mean = 100 * (other.mean() / load[late].mean() - 1)
    print(f"   {name}: section over quarter: mean load {mean:+.2f} %, scatter {off.std():.2f} %", flush=True)
    check(f"{name}: mean load of the section over that of the quarter, off 1, %", mean, 0.5)


for one in sys.argv[1:]:
    beside(one)
finish()
