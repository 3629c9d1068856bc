"""Levels that the estimated error places, under a ball that is pressed into an elastic-plastic block and slides
over it, and under a cylinder that rolls on it: they follow the tool, keep to their budget, keep mass and the
balance of energy, and give load and peak recovered stress of a grid that is as fine everywhere within 2 %,
with a part of its particle-steps."""

import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
from checks import finish, require
from gimp3d.run_data import History
from gimp3d.run_log import facts_of, numbers_of

GIMP3D = sys.argv[1]
SCENE = """&scene title='a tool moves along', end_time=1.5 /
&grid lower=0,0,0, upper=20,8,9, cell_size={cell}, boundary='roller','roller','symmetry','roller','roller','free' /
{level}
&material name='m', model='j2', density=1, young=1000, poisson=0.3, yield_stress=30, hardening_modulus=50 /
&body material='m', shape='box', lower=0,0,0, upper=20,8,6, particles_per_cell=8 /
&tool name='tool', {tool}, tip=6,0,6, times=0,0.05,0.25,0.3, speeds=0,2,2,0 /
&motion tool='tool', kind='slide', axis=1,0,0, times=0.3,0.35, speeds=0,4 /
&output directory='{name}', formats='hdf5', every=0.5 /
"""
BALL = "shape='sphere', radius=4"
ROLLER = (
    "shape='cylinder', radius=4, edge=0,1,0, friction=0.3",
    "&motion tool='tool', kind='turn', axis=0,1,0, point=6,0,10, times=0.3,0.35, speeds=0,1 /\n",
)


class Run:
    """One run: mean loads down and along while the tool moves (N), peak recovered von Mises stress at its end
    (Pa), particle-steps and seconds, boxes around the second level, mass (kg), error of the balance (%)."""

    def __init__(self, name, level, cell=1.0, ranks=1, tool=BALL, more=""):
        shutil.rmtree(name, ignore_errors=True)
        text = SCENE.format(name=name, level=level, cell=cell, tool=tool) + more
        command = [GIMP3D] if ranks == 1 else ["mpirun", "-n", str(ranks), GIMP3D]
        done = subprocess.run(command, input=text, text=True, capture_output=True)
        if done.returncode:
            sys.exit(f"{name} ends with status {done.returncode}: {done.stderr}")
        rows = History(Path(name, "tool_tool.dat"))
        late = rows["time"] > 0.8
        self.loads = [rows[f"load_{axis}"][late].mean() for axis in "zx"]
        cost = numbers_of(facts_of(Path(name, "cost.dat")))
        self.steps = int(cost["particle_steps"])
        self.seconds = cost["processor_share"] * cost["elapsed_s"] * cost["ranks"]
        self.boxes = []
        for path in sorted(Path(name).glob("particles_*.hdf")):
            with h5py.File(path) as file:
                data = file["VTKHDF/FieldData"]
                if "level_lower" in data:
                    self.boxes.append((data["level_lower"][1], data["level_upper"][1]))
                self.peak = von_mises(file["VTKHDF/PointData/stress_recovered"][:]).max()
        self.mass = History(Path(name, "energy.dat"))["mass"]
        self.balance = 100 * abs(cost["energy_balance_error_J"]) / cost["largest_energy_J"]


def von_mises(stress):
    normal, shear = stress[:, :3], stress[:, 3:]
    deviator = normal - normal.mean(axis=1, keepdims=True)
    return np.sqrt(1.5 * (deviator**2).sum(axis=1) + 3 * (shear**2).sum(axis=1))


def compare(what, level, share, tool=BALL, more=""):
    """A placed level beside grids as fine, and as coarse, everywhere."""
    fine = Run(f"{what}_fine", "", 0.5, tool=tool, more=more)
    coarse = Run(f"{what}_coarse", "", tool=tool, more=more)
    placed = Run(f"{what}_placed", level, tool=tool, more=more)
    off = lambda one, other: 100 * (one / other - 1)
    require(
        f"{what}: load {off(placed.loads[0], fine.loads[0]):+.2f} % off the fine grid's; the coarse one "
        f"{off(coarse.loads[0], fine.loads[0]):+.2f} %; along "
        + ", ".join(f"{run.loads[1]:.4g}" for run in (placed, fine, coarse))
        + " N",
        abs(off(placed.loads[0], fine.loads[0])) < 2,
    )
    require(
        f"{what}: peak recovered stress {off(placed.peak, fine.peak):+.2f} %; "
        f"the coarse one {off(coarse.peak, fine.peak):+.2f} %",
        abs(off(placed.peak, fine.peak)) < 2,
    )
    require(
        f"{what}: {100 * placed.steps / fine.steps:.0f} % of the particle-steps, "
        f"{100 * placed.seconds / fine.seconds:.0f} % of the time",
        placed.steps < share * fine.steps,
    )
    print("   boxes:", [f"x {low[0]:g} to {high[0]:g}, z from {low[2]:g}" for low, high in placed.boxes])
    require(f"{what}: the level has followed the tool", placed.boxes[-1][1][0] > placed.boxes[0][1][0] + 3)
    change = np.abs(placed.mass / placed.mass[0] - 1).max()
    require(f"{what}: mass {change:.1e}", change < 1e-12)
    require(
        f"{what}: energy balance {placed.balance} %, {fine.balance} % on the fine grid",
        placed.balance < fine.balance + 1,
    )
    return fine


LEVEL = "&level criterion='error', max_cells={}, tolerance=0.1 /"
fine = compare("sliding", LEVEL.format(3000), 0.6)
compare("rolling", LEVEL.format(6000), 0.8, *ROLLER)
# the bits of contact depend on the ranks, and regions may differ by a cell with them
two = Run("placed_on_two", LEVEL.format(3000), ranks=2)
require(
    f"load on two ranks {100 * (two.loads[0] / fine.loads[0] - 1):+.2f} % off the fine grid's",
    abs(two.loads[0] / fine.loads[0] - 1) < 0.02,
)
finish()
