"""The energies of shipped scenes at the end of a thousandth of their time (a ten-thousandth with quasi-static
steps), against those that are stored (test/references/baselines.json): what drifts is seen. With `store` the
file is made anew, which a commit says. usage: baselines.py [store] (in an empty directory)"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from gimp3d.run_data import History

ROOT = Path(__file__).resolve().parents[2]
STORED = ROOT / "test" / "references" / "baselines.json"
SCENES = (
    "bar",
    "berkovich",
    "bilinear_levels",
    "cantilever",
    "cone",
    "cone_levels",
    "crystal",
    "hertz",
    "plate_with_hole",
    "sand",
    "slide",
    "sphere_levels",
    "static_cone",
    "taylor",
    "two_spheres",
)
COLUMNS = ("kinetic", "strain", "plastic", "external_work", "mass", "momentum_x", "momentum_y", "momentum_z")
TOLERANCE = 1e-4  # of the largest energy, mass or momentum: other compilers and ranks stay far below


def scale_of(name, figures):
    kind = "momentum" if name.startswith("momentum") else name if name == "mass" else "energy"
    of_kind = {
        "energy": ("kinetic", "strain", "plastic", "external_work"),
        "momentum": ("momentum_x", "momentum_y", "momentum_z"),
        "mass": ("mass",),
    }[kind]
    return max(abs(figures[other]) for other in of_kind)


def run(name):
    text = (ROOT / "input" / f"{name}.nml").read_text()
    share = 1e4 if "&quasi_static" in text else 1e3
    end = re.search(r"end_time=([-+0-9.eEdD]+)", text)
    text = text.replace(end[0], f"end_time={float(end[1]) / share:.9g}", 1)
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"FAILED: {name} ended with status {done.returncode}: {done.stderr}")
    directory = re.search("directory='([^']*)'", text)[1]
    rows = History(Path(directory) / "energy.dat")
    return {column: float(rows[column][-1]) for column in COLUMNS}


def main():
    if not Path("input").exists():
        Path("input").symlink_to(ROOT / "input")
    found = {name: run(name) for name in SCENES}
    if sys.argv[1:] == ["store"]:
        STORED.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")
        print(f"{STORED}: {len(found)} scenes")
        return 0
    stored = json.loads(STORED.read_text())
    wrong = 0
    for name in SCENES:
        for column in COLUMNS:
            scale = scale_of(column, stored[name])
            far = abs(found[name][column] - stored[name][column])
            if far > TOLERANCE * scale:
                wrong += 1
                print(
                    f"FAILED: {name}: {column} {found[name][column]:.9g}, stored {stored[name][column]:.9g}"
                )
    print(f"{len(SCENES)} scenes, {len(COLUMNS)} figures each: {wrong} beyond {TOLERANCE:g} of their scale")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
