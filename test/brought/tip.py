"""A tip as a microscope measures it: a Berkovich tip rounded by 60 nm, 256 by 256 heights in nm, the first line
on top, with a bump on one of its faces. Its imprint has the bump at the right corner, and without the bump it
bears what the analytic tip bears."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

from gimp3d.run_data import History

N, WIDTH = 256, 2.4e-6
ANGLE, ROUND = np.radians(65.27), 60e-9
BUMP = np.array([420e-9, 260e-9])  # right of the apex and above it in the picture
SCENE = """&scene title='{name}', end_time={end!r} /
&grid lower=-1.2e-6,-1.2e-6,0, upper=1.2e-6,1.2e-6,1.6e-6, cell_size=8e-8, boundary=4*'free', 'roller', 'free' /
&material name='m', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='m', shape='box', lower=-1.12e-6,-1.12e-6,0, upper=1.12e-6,1.12e-6,1.2e-6, particles_per_cell=1 /
&tool name='tip', {tool}, tip=0,0,1.2e-6, times=0,4e-11, speeds=0,300 /
&output directory='{name}', every={end!r}, history_every=0 /
"""
DEPTH = 2.4e-7
failures = 0


def judge(what, good):
    global failures
    failures += not good
    print(("   " if good else "FAILED: ") + what)


def heights(bump):
    """In m, (along y from the bottom, along x), the apex up."""
    at = (np.arange(N) - (N - 1) / 2) * WIDTH / N
    x, y = np.meshgrid(at, at)
    r = np.hypot(x, y)
    faces = [x, -0.5 * x + np.sqrt(0.75) * y, -0.5 * x - np.sqrt(0.75) * y]
    pyramid = np.max(faces, axis=0) / np.tan(ANGLE)
    centre = ROUND / np.sin(ANGLE)
    ball = centre - np.sqrt(np.maximum(ROUND**2 - r**2, 0))
    depth = np.where(r < ROUND * np.cos(ANGLE), np.maximum(pyramid, ball), pyramid)
    off = np.hypot(x - BUMP[0], y - BUMP[1])
    return -depth + bump * 1.2e-7 * np.exp(-((off / 9e-8) ** 2))


def run(name, tool):
    scene = SCENE.format(name=name, tool=tool, end=DEPTH / 300 + 2e-11)
    done = subprocess.run([os.environ["GIMP3D"]], input=scene, capture_output=True, text=True, timeout=900)
    if done.returncode:
        sys.exit(f"FAILED: {name}: {done.stderr[-500:]}")
    rows = History(Path(name) / "tool_tip.dat")
    return np.interp(np.linspace(0.1, 1, 91) * DEPTH, rows["depth"], rows["load_z"])


def pressed(name):
    """The pressure of the contact around the bump, and around its three mirror images."""
    with h5py.File(sorted(Path(name).glob("particles_*.hdf"))[-1]) as file:
        points = file["VTKHDF/Points"][()]
        pressure = file["VTKHDF/PointData/contact_pressure"][()]
    found = {}
    for sx in (1, -1):
        for sy in (1, -1):
            near = np.hypot(points[:, 0] - sx * BUMP[0], points[:, 1] - sy * BUMP[1]) < 1.3e-7
            found[sx, sy] = pressure[near].sum()
    return found


def text(path, map_, top):
    np.savetxt(path, 1e9 * (map_[::-1] if top else map_), fmt="%.2f", delimiter="\t")


surface = f"shape='surface', file='{{}}', scale=1e-9, spacing={WIDTH / N!r},{WIDTH / N!r}, rotation=180,0,0"
text("plain.txt", heights(0), True)
text("bump.txt", heights(1), True)
plain = run("plain", surface.format("plain.txt") + ", first_row='top'")
exact = run("exact", "shape='berkovich', half_angle=65.27, tip_radius=60e-9")
off = np.abs(plain - exact).max() / exact.max()
judge(f"load of the map off that of the analytic tip by {100 * off:.2f} % of the largest", off < 0.03)
for name, words, right in (("bump", ", first_row='top'", (1, -1)), ("mirrored", "", (1, 1))):
    run(name, surface.format("bump.txt") + words)
    found = pressed(name)
    most = max(found, key=found.get)
    others = max(value for corner, value in found.items() if corner != right)
    what = ", ".join(f"{corner}: {value / 1e9:.1f}" for corner, value in found.items())
    judge(
        f"{name}: the bump presses at {most}, turned about x from the picture ({what} GPa)",
        most == right and others < 0.5 * found[right],
    )
sys.exit(failures > 0)
