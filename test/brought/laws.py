"""Five user laws as their owners would write them, in the forms of old and new templates, against the built-in
ones: the load of a ball that is pressed into a block. And what a law that calls XIT comes to."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from gimp3d.run_data import History

BAR = 3e-3  # of the largest load
SCENE = """&scene title='{name}', end_time=4e-6 /
&grid lower=0,0,0, upper=8e-3,8e-3,6e-3, cell_size=1e-3, boundary='symmetry','free','symmetry','free','roller','free' /
&time safety=0.3, domain='corners' /
&material name='law', density=7850, {law} /
&body material='law', shape='box', lower=0,0,0, upper=6e-3,6e-3,4e-3, particles_per_cell={particles} /
{more}&tool name='ball', shape='sphere', radius=8e-3, tip=0,0,4e-3, times=0, speeds=60 /
&output directory='{name}', formats='none', history_every=0 /
"""
STEEL = "young=200e9, poisson=0.3"
LAWS = {
    "elastic": (f"model='elastic', {STEEL}", "constants=200e9, 0.3"),
    "j2_new": (
        f"model='j2', {STEEL}, yield_stress=350e6, hardening_modulus=1e9",
        "states=2, constants=200e9, 0.3, 350e6, 1e9",
    ),
    "kinematic": (
        f"model='j2', {STEEL}, yield_stress=350e6, kinematic_modulus=20e9",
        "states=6, constants=200e9, 0.3, 350e6, 20e9",
    ),
    "thermal": (
        "model='elastic', young=180e9, poisson=0.3",
        "temperature=493, constants=200e9, 0.3, 5e-4, 293",
    ),
    "table": (
        f"model='j2', {STEEL}, hardening_stress=350e6,420e6,500e6, hardening_strain=0,0.005,0.1",
        "states=1, constants=200e9, 0.3, 350e6, 0, 420e6, 0.005, 500e6, 0.1",
    ),
}
failures = 0


def judge(what, good):
    global failures
    failures += not good
    print(("   " if good else "FAILED: ") + what)


def run(name, law, particles=1, more=""):
    scene = SCENE.format(name=name, law=law, particles=particles, more=more)
    return subprocess.run([os.environ["GIMP3D"]], input=scene, capture_output=True, text=True, timeout=300)


def load(name, law, particles=1, more=""):
    done = run(name, law, particles, more)
    if done.returncode:
        sys.exit(f"FAILED: {name}: {done.stderr}")
    history = History(Path(name) / "tool_ball.dat")
    return history["load_z"]


for name, (built_in, own) in LAWS.items():
    right = load(f"{name}_built_in", built_in)
    mine = load(name, f"model='vumat', library='./{name}.so', {own}")
    off = np.abs(mine - right).max() / np.abs(right).max()
    judge(
        f"{name}: load {np.abs(right).max():.1f} N, off that of the built-in law by {100 * off:.4f} %",
        off < BAR,
    )
# eight a cell, where contact of what cannot flow has the compliance below a cell
built_in, own = LAWS["j2_new"]
eight = (8, "&anti_locking kind='volumetric' /\n")  # which metals have by default, and user laws have not
right = load("eight_built_in", built_in, *eight)
mine = load("eight", f"model='vumat', library='./j2_new.so', {own}", *eight)
off = np.abs(mine - right).max() / np.abs(right).max()
judge(f"j2_new, 8 particles a cell: {100 * off:.4f} %", off < BAR)
other = load("other", LAWS["j2_new"][0].replace("350e6", "360e6"))
off = np.abs(other - load("again", LAWS["j2_new"][0])).max() / np.abs(other).max()
judge(f"a yield stress 3 % higher would be seen: {100 * off:.2f} %", off > BAR)
for name, law, sentence in (
    ("xit", "model='vumat', library='./elastic.so', constants=200e9", "elastic.so' has ended the program"),
    (
        "exit",
        "model='vumat', library='./j2_new.so', states=2, constants=200e9, 0.3, 1e9",
        "j2_new.so' has ended the program",
    ),
    ("error", "model='vumat', library='./kinematic.so', constants=200e9, 0.3, 1e9", "has ended the program"),
    (
        "room",
        "model='vumat', library='./kinematic.so', states=3, constants=200e9, 0.3, 1e9, 1e9",
        "states=3: the law",
    ),
):
    done = run(name, law)
    said = re.findall("^gimp3d: (.*)", done.stderr, re.M)
    judge(
        f"{name}: status {done.returncode}, {said}",
        done.returncode == 2 and len(said) == 1 and sentence in said[0],
    )
sys.exit(failures > 0)
