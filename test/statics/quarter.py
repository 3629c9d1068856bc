"""A quarter of a block under a sphere, in quasi-static steps, bears a quarter of the whole block's load at every
step: nodes, contact points and the ghost penalty at the planes of symmetry are those of the whole."""

from pathlib import Path

import numpy as np

from checks import check, finish
from gimp3d.run_data import History
from run_scene import run

SCENE = """&scene title='{name}', end_time=1 /
&grid lower={low},{low},0, upper=0.8,0.8,0.8, cell_size=0.1,
      boundary={side},'free',{side},'free','fixed','free' /
&material name='m', {law}, density=1000, young=1e6, poisson=0.3 /
&body material='m', shape='box', lower={start},{start},0, upper=0.5,0.5,0.4 /
&tool name='ball', shape='sphere', radius=0.4, tip=0,0,0.4, axis=0,0,-1, times=0, speeds=0.06 /
&quasi_static step=0.1, max_step=0.1, tolerance=1e-9 /
&output directory='{name}', formats='none' /
"""
LAWS = {
    # law, bound: where metal flows round-off chooses which particle yields first
    "elastic": ("model='elastic'", 1e-5),
    "metal": ("model='j2', yield_stress=1e4, hardening_modulus=2e4", 2e-3),
}


def load(name, **values):
    run(SCENE.format(name=name, **values), 1)
    return History(Path(name) / "tool_ball.dat")["load_z"][1:]


for name, (law, bound) in LAWS.items():
    whole = load(f"{name}_whole", law=law, low=-0.8, start=-0.5, side="'free'")
    quarter = load(f"{name}_quarter", law=law, low=0, start=0, side="'symmetry'")
    off = np.abs(4 * quarter / whole - 1).max()
    check(f"{name}: four times a quarter's load over the whole's, less 1, at any step", off, bound)
finish()
