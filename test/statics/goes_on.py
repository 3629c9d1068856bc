"""Implicit steps that go on from a checkpoint give the same bits as ones that were never stopped, on the same
number of ranks: friction of bodies and of a tool, a tool with a load on material that creeps, one on material
that relaxes, metal with inertia. usage: goes_on.py (in an empty directory; GIMP3D is the program)"""

import os
import subprocess
from pathlib import Path

import numpy as np

from static_scenes import ROOT, History, finish, last_particles, require, run

BALL = """&scene title='{name}', end_time=1.5 /
&grid lower=0,0,0, upper=8,8,6, cell_size=1, boundary='symmetry','free','symmetry','free','fixed','free' /
&material name='m', density=0.1, young=1, poisson=0.3, {law} /
&body material='m', shape='box', lower=0,0,0, upper=6,6,3 /
&tool name='ball', shape='sphere', radius=6, tip=0,0,3.5, times=0,1,2, {moves} /
&quasi_static {steps} /
&output directory='{name}', history_every=1e-9 /
"""
SCENES = {
    "creeps": (
        "model='norton', creep_stress=0.1, creep_rate=0.1, creep_exponent=3",
        "loads=0,0.5,0, mass=1, friction=0.3",
        "step=0.25, max_step=0.25",
    ),
    "relaxes": (
        "model='maxwell', relaxation_times=0.7, shear_ratios=0.8, bulk_ratios=0.6",
        "speeds=1.5,0.2,0, friction=0.3",
        "step=0.25, max_step=0.25",
    ),
    "swings": (
        "model='j2', yield_stress=0.05",
        "speeds=0.8,0,-0.8, friction=0.3",
        "mode='newmark', step=0.25",
    ),
}


def goes_on(name, text, ranks):
    """The run keeps its last two checkpoints: without the newest it goes on from the one before."""
    run(text.rstrip() + "\n&checkpoint every_steps=1 /\n", ranks)
    whole = last_particles(name)
    rows = Path(name, "energy.dat").read_text().splitlines()
    sorted(Path(name).glob("checkpoint_*.h5"))[-1].unlink()
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), os.environ["GIMP3D"], "--restart", name], capture_output=True, text=True
    )
    require(f"{name}, {ranks} ranks: goes on", done.returncode == 0 and "goes on    from" in done.stdout)
    again = last_particles(name)
    for field, values in whole.items():
        same = np.array_equal(values, again[field], equal_nan=True)
        require(f"{name}, {ranks} ranks: {field}, the same bits", same)
    require(
        f"{name}, {ranks} ranks: energies, the same bits",
        rows == Path(name, "energy.dat").read_text().splitlines(),
    )
    if "maxwell" in text:
        relaxed = float(History(Path(name) / "cost.dat").notes["relaxed_below_cells_J"])
        require(f"{name}: {relaxed:.3g} J were dissipated below the cells", relaxed > 1e-4)


if __name__ == "__main__":
    for number, (name, (law, moves, steps)) in enumerate(SCENES.items()):
        goes_on(name, BALL.format(name=name, law=law, moves=moves, steps=steps), min(2, 1 + number))
    roller = (ROOT / "input/static_roller.nml").read_text()
    goes_on(
        "roller", roller.replace("end_time=1 ", "end_time=0.4 ").replace("out/static_roller", "roller"), 1
    )
    finish()
