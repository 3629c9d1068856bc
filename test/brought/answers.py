"""What a run makes of a file of grains or of a surface: the answer is judged beside what is known of the
file. Used by table.py and readers.py; with the word `short` behind, each fourth file only."""

import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

SHORT = sys.argv[2:] == ["short"]
SECONDS = 120 * float(os.environ.get("SLOWNESS", "1"))
table, failures, asked = [], 0, 0


def left_out():
    """Whether the next file is not looked at this time."""
    global asked
    asked += 1
    return SHORT and asked % 4 != 1


def judge(name, right, seen):
    global failures
    failures += not right
    table.append((name, seen, "yes" if right else "NO"))
    print(("   " if right else "FAILED: ") + f"{name}: {seen}")


GRAINS = """&scene title='{stem}', end_time=1e-12 /
&grid lower=0,0,0, upper=1e-5,1e-5,1e-5, cell_size=1e-6, boundary=6*'symmetry' /
&material name='copper', model='cubic', density=8960, c11=170e9, c12=124e9, c44=75e9 /
&body material='copper', shape='box', lower=0,0,0, upper=1e-5,1e-5,1e-5, particles_per_cell=1 /
&grains lower=0,0,0, upper=1e-5,1e-5,1e-5, file='{file}'{more} /
&output directory='out/{stem}' /
"""
SURFACE = """&scene title='{stem}', end_time=1e-12 /
&grid lower=-2e-6,-2e-6,-4e-6, upper=2e-6,2e-6,2e-6, cell_size=4e-7 /
&material name='m', model='elastic', density=2000, young=1e9, poisson=0.3 /
&body material='m', shape='surface', file='{file}'{more}, particles_per_cell=1, fill='share' /
&output directory='out/{stem}', formats='none' /
"""


def stem_of(name):
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")


def run(text):
    """Status, first sentence, and the first lines of a run."""
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True, timeout=SECONDS)
    said = re.findall("^gimp3d: (.*)", done.stderr, re.M)
    return done.returncode, said[0] if said else "", done.stdout


def prepared(text, name, content, more):
    stem = stem_of(name)
    Path(f"{stem}.file").write_bytes(content)
    return stem, text.format(stem=stem, file=f"{stem}.file", more=", " + more if more else "")


def refuse(text, name, content, sentence, more=""):
    if left_out():
        return
    stem, scene = prepared(text, name, content, more)
    status, said, _ = run(scene)
    good = (
        status == 2
        and sentence in said
        and f"file='{stem}.file'" in said
        and not Path(f"out/{stem}").exists()
    )
    judge(name, good, f"refused: {said}")


def grains(name, content, voxels, quaternions, more="", nearest=None):
    """The grain and the orientation of each particle, beside those that are known."""
    if left_out():
        return None
    stem, scene = prepared(GRAINS, name, content, more)
    status, said, _ = run(scene)
    if status != 0:
        return judge(name, False, f"status {status}: {said}")
    with h5py.File(sorted(Path(f"out/{stem}").glob("particles_*.hdf"))[0]) as file:
        points, data = file["VTKHDF/Points"][()], file["VTKHDF/PointData"]
        number, orientation = data["grain"][()].astype(int), data["orientation"][()]
    if nearest is not None:
        seeds, weights = nearest
        power = ((points[:, None, :] - seeds) ** 2).sum(axis=2) - weights**2
        right = power.argmin(axis=1) + 1
    else:
        at = np.minimum((points / 1e-5 * voxels.shape).astype(int), np.array(voxels.shape) - 1)
        right = voxels[tuple(at.T)]
    wanted = np.vstack([[1, 0, 0, 0], quaternions])[right]
    off = np.degrees(2 * np.arccos(np.clip(np.abs((orientation * wanted).sum(axis=1)), 0, 1)))
    judge(
        name,
        bool((number == right).all() and off.max() < 1e-3),
        f"{(number == right).sum()} of {len(right)} particles in their grain, "
        f"{len(set(right) - {0})} grains, axes within {off.max():.1e} degrees",
    )


def volume(name, content, exact, more="", bar=1e-2):
    """The volume of a body of the file."""
    if left_out():
        return None
    stem, scene = prepared(SURFACE, name, content, more)
    status, said, out = run(scene)
    found = re.search(r"^body .* volume (\S+) m3", out, re.M)
    if status != 0 or not found:
        return judge(name, False, f"status {status}: {said}")
    off = float(found[1]) / exact - 1
    judge(name, abs(off) < bar, f"volume {float(found[1]):.5g} m3, {100 * off:+.3f} % off")
