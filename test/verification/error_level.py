"""A level that the estimated error places, under a ball that is pressed into an elastic-plastic block and
slides over it: it follows the ball, keeps to its budget, keeps mass and the balance of energy, and gives the
load of a grid that is as fine everywhere within 2 %, with a fraction of its particle-steps."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

GIMP3D = sys.argv[1]
SCENE = """&scene title='a ball slides', end_time=1.5 /
&grid lower=0,0,0, upper=20,8,9, cell_size={cell}, boundary='roller','roller','symmetry','roller','roller','free' /
{level}
&material name='m', model='j2', density=1, young=1000, poisson=0.3, yield_stress=30, hardening_modulus=50 /
&body material='m', shape='box', lower=0,0,0, upper=20,8,6, particles_per_cell=8 /
&tool name='ball', shape='sphere', radius=4, tip=6,0,6, times=0,0.05,0.25,0.3, speeds=0,2,2,0 /
&motion tool='ball', kind='slide', axis=1,0,0, times=0.3,0.35, speeds=0,4 /
&output directory='{name}', formats='hdf5', every=0.5 /
"""


def run(name, level, cell=1.0, ranks=1):
    shutil.rmtree(name, ignore_errors=True)
    text = SCENE.format(name=name, level=level, cell=cell)
    command = [GIMP3D] if ranks == 1 else ["mpirun", "-n", str(ranks), GIMP3D]
    done = subprocess.run(command, input=text, text=True, capture_output=True)
    if done.returncode:
        sys.exit(f"{name} ends with status {done.returncode}: {done.stderr}")
    lines = Path(name, "tool_ball.dat").read_text().splitlines()
    names = re.findall(r'"(\w+) \[', next(line for line in lines if line.startswith("VARIABLES")))
    rows = np.loadtxt([line for line in lines if re.match(r"^\s*[-0-9]", line)])
    late = rows[:, 0] > 0.8
    loads = [rows[late, names.index(f"load_{axis}")].mean() for axis in "zx"]
    steps = int(re.search(r"^(\d+) particle-steps", done.stdout, re.M).group(1))
    boxes = []
    for path in sorted(Path(name).glob("particles_*.h5")):
        with h5py.File(path) as file:
            data = file["VTKHDF/FieldData"]
            if "level_lower" in data:
                boxes.append((data["level_lower"][1], data["level_upper"][1]))
    lines = Path(name, "energy.dat").read_text().splitlines()
    names = re.findall(r'"(\w+) \[', next(line for line in lines if line.startswith("VARIABLES")))
    mass = np.array(
        [float(line.split()[names.index("mass")]) for line in lines if re.match(r"^\s*[-0-9]", line)]
    )
    balance = float(re.search(r"^energy balance error: .*, ([0-9.e-]+) %", done.stdout, re.M).group(1))
    return loads, steps, boxes, mass, balance


failed = False


def need(condition, what):
    global failed
    failed |= not condition
    print(f"   {'' if condition else 'FAILED: '}{what}")


LEVEL = "&level criterion='error', max_cells=3000, tolerance=0.1 /"
fine, all_steps, _, _, balance_fine = run("fine", "", cell=0.5)
coarse, _, _, _, _ = run("coarse", "")
loads, steps, boxes, mass, balance = run("placed", LEVEL)
print(
    f"   load {loads[0]:.5g}, fine {fine[0]:.5g}, coarse {coarse[0]:.5g} N; along {loads[1]:.4g}, "
    f"{fine[1]:.4g}, {coarse[1]:.4g} N"
)
need(
    abs(loads[0] / fine[0] - 1) < 0.02,
    f"load {100 * (loads[0] / fine[0] - 1):+.2f} % off the fine grid's; the coarse one "
    f"{100 * (coarse[0] / fine[0] - 1):+.2f} %",
)
need(steps < 0.6 * all_steps, f"{100 * steps / all_steps:.0f} % of the fine grid's particle-steps")
print(
    "   boxes around the level:", [f"x {low[0]:g} to {high[0]:g}, z from {low[2]:g}" for low, high in boxes]
)
need(boxes[-1][1][0] > boxes[0][1][0] + 3, "the level has followed the ball")
need(np.abs(mass / mass[0] - 1).max() < 1e-12, f"mass {np.abs(mass / mass[0] - 1).max():.1e}")
need(balance < balance_fine + 1, f"energy balance {balance} %, {balance_fine} % on the fine grid")
# the bits of contact depend on the ranks, and regions may differ by a cell with them
two, _, _, _, _ = run("placed_on_two", LEVEL, ranks=2)
need(
    abs(two[0] / fine[0] - 1) < 0.02,
    f"load on two ranks {100 * (two[0] / fine[0] - 1):+.2f} % off the fine grid's",
)
sys.exit(1 if failed else 0)
