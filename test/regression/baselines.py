"""Shipped scenes over the first part of their time, so far that tools press, bodies touch and metals flow: energies,
mass, momentum and the loads of tools at its end against stored ones (test/references/baselines.json), so that what
drifts is seen. As a control one elastic constant is 1 % higher: that must be seen too. With `store` the file is made
anew, which a commit says. usage: baselines.py short|whole|store (in an empty directory)"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from checks import finish, require
from gimp3d.run_data import History

ROOT = Path(__file__).resolve().parents[2]
STORED = ROOT / "test" / "references" / "baselines.json"
SHORT = {  # the share of end_time that is run
    "axisymmetric_taylor": 0.05,
    "bar": 0.05,
    "billet": 0.02,
    "cantilever": 0.05,
    "hertz": 0.2,
    "plate_with_hole": 0.02,
    "polycrystal": 0.02,
    "sand": 0.02,
    "self_weight": 0.1,
    "slide": 0.03,
    "static_cone": 0.15,
    "taylor": 0.03,
    "tube": 0.05,
}
LONG = {
    "bilinear_levels": 0.3,
    "cone": 0.12,
    "crystal": 0.06,
    "press_fit": 0.1,
    "sphere_levels": 0.08,
    "static_levels": 0.2,
}
CONTROLS = ("billet", "taylor", "static_cone")  # of the short form; all in the long one
ENERGIES = ("kinetic", "strain", "plastic", "external_work")
COLUMNS = (*ENERGIES, "mass", "momentum_x", "momentum_y", "momentum_z")
TOLERANCE = 1e-4  # of a figure: other compilers and ranks stay far below
NOISE = 1e-7  # of the largest figure of its kind, where a figure is close to 0
CONSTANTS = r"(young|c11|bulk_modulus|shear_modulus)=([-+0-9.eEdD]+)"


def run(name, share, stiffer=False):
    """The figures at the end, by name."""
    text = (ROOT / "input" / f"{name}.nml").read_text()
    end = re.search(r"end_time=([-+0-9.eEdD]+)", text)
    text = text.replace(end[0], f"end_time={share * float(end[1]):.9g}", 1)
    if stiffer:
        text = re.sub(CONSTANTS, lambda m: f"{m[1]}={1.01 * float(m[2]):.9g}", text, count=1)
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"FAILED: {name} ended with status {done.returncode}: {done.stderr}")
    directory = Path(re.search("directory='([^']*)'", text)[1])
    rows = History(directory / "energy.dat")
    figures = {column: float(rows[column][-1]) for column in COLUMNS}
    for path in sorted(directory.glob("tool_*.dat")):
        figures |= {f"{path.stem} load_{axis}": float(History(path)[f"load_{axis}"][-1]) for axis in "xyz"}
    return figures


def kind_of(name):
    return "energy" if name in ENERGIES else name.split("_")[0] if "tool" not in name else "load"


def apart(found, stored):
    """The figures that are further from the stored ones than is allowed, with by how much of the allowed."""
    largest = {}
    for name, value in stored.items():
        largest[kind_of(name)] = max(abs(value), largest.get(kind_of(name), 0.0))
    far = {}
    for name, value in stored.items():
        allowed = max(TOLERANCE * abs(value), NOISE * largest[kind_of(name)])
        if abs(found[name] - value) > allowed:
            far[name] = f"{found[name]:.9g}, stored {value:.9g}"
    return far


def main():
    how = sys.argv[1]
    Path("input").symlink_to(ROOT / "input")
    scenes = SHORT if how == "short" else SHORT | LONG
    if how == "store":
        STORED.write_text(
            json.dumps({n: run(n, s) for n, s in scenes.items()}, indent=1, sort_keys=True) + "\n"
        )
        print(f"{STORED}: {len(scenes)} scenes")
        return
    stored = json.loads(STORED.read_text())
    for name, share in scenes.items():
        require(f"{name}: something happens", stored[name]["strain"] > 0)
        far = apart(run(name, share), stored[name])
        require(f"{name}: {len(stored[name])} figures as stored", not far, far)
    for name in CONTROLS if how == "short" else scenes:
        seen = apart(run(name, scenes[name], stiffer=True), stored[name])
        require(f"{name} 1 % stiffer: seen in {', '.join(seen) or 'nothing'}", "strain" in seen)
    finish()


main()
