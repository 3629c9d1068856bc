"""What a coarse impact costs: a block falls on a rigid floor, bounces and flies free. Energy that rings away
in the flight, and how far the sideways momentum after a bounce that sticks depends on where the block lies in
the grid, by cells an edge and by what the particles carry. The table of doc/user/accuracy.md, Coarse impacts.

   bounce.py [CELLS...]      the cells an edge (4 8 16)
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from checks import finish, require
from runs import History

EDGE, SPEED, WAVE = 0.4, 1.0, 31.6  # m, m/s, m/s
PERIOD = 2 * EDGE / WAVE  # s, of the first mode along an edge
SCENE = """
&scene    title='a block bounces', end_time={end} /
&grid     lower=-0.8,-0.8,-0.4, upper=1.6,1.2,1.6, cell_size={cell} /
&time     {time} /
&material name='rubber', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body     material='rubber', shape='box', lower={x},0,{z}, upper={x_end},{edge},{z_end}, velocity={sideways},0,-{speed} /
&tool     name='floor', shape='flat', radius=3, tip=0.2,0.2,0, axis=0,0,1, times=0, speeds=0{friction} /
&output   directory='{name}', formats='none', history_every={every} /
"""
WAYS = {
    "affine": "transfer='affine'",
    "plain": "transfer='plain'",
    "plain, flip_fraction=0.99": "transfer='plain', flip_fraction=0.99",
    "affine, corners": "domain='corners'",
    "plain, corners": "domain='corners', transfer='plain'",
}


def run(name, cells, time, periods, offset=(0.0, 0.0), sideways=0.0, friction=""):
    cell = EDGE / cells
    x, z = offset[0] * cell, (0.25 + offset[1]) * cell
    text = SCENE.format(
        end=periods * PERIOD + z / SPEED,
        cell=cell,
        time=time,
        x=x,
        x_end=x + EDGE,
        edge=EDGE,
        z=z,
        z_end=z + EDGE,
        sideways=sideways,
        speed=SPEED,
        friction=friction,
        name=name,
        every=0.05 * PERIOD,
    )
    Path(f"{name}.nml").write_text(text)
    done = subprocess.run([os.environ["GIMP3D"]], input=text, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"FAILED: {name}: status {done.returncode}: {done.stderr[-500:]}")
    return History(Path(name) / "energy.dat"), History(Path(name) / "tool_floor.dat")


def parted(tool):
    """Index of the first row after the last load."""
    return int(np.flatnonzero(np.abs(tool["load_z"]) > 0)[-1]) + 1


def flight(cells, way):
    """Shares of the energy before the bounce: what rings in the flight at its begin, and what of all is lost
    over ten periods."""
    energy, tool = run("flight", cells, WAYS[way], 13)
    total, first = energy["kinetic"] + energy["strain"], parted(tool)
    last = min(first + 200, len(total) - 1)
    carried = 0.5 * np.sum([energy[f"momentum_{a}"][first] ** 2 for a in "xyz"]) / energy["mass"][first]
    return (
        (total[first] - carried) / total[0],
        (total[first] - total[last]) / total[0],
        (total[0] - total[first]) / total[0],
    )


def sticking(cells, way):
    """Spread of the sideways momentum after a bounce, over that before it, with the block at 3 x 3 places
    within a cell."""
    momenta = []  # 3 periods after the block would reach the floor
    for i in range(3):
        for k in range(3):
            energy, tool = run("sticking", cells, WAYS[way], 3, (i / 3, k / 3), 0.5, ", friction=2")
            momenta.append(energy["momentum_x"][-1])
    return (max(momenta) - min(momenta)) / energy["momentum_x"][0]


counts = [int(word) for word in sys.argv[1:]] or [4, 8, 16]
print(f"| particles | {' | '.join(f'{n} cells: lost in the bounce, ringing, rung away' for n in counts)} |")
print("| --- |" + " --- |" * len(counts))
for way in WAYS:
    found = [flight(n, way) for n in counts]
    print(
        f"| {way} | "
        + " | ".join(f"{100 * c:.1f} %, {100 * a:.1f} %, {100 * b:.1f} %" for a, b, c in found)
        + " |",
        flush=True,
    )
    lost = [b for _, b, _ in found]
    if way.startswith("affine"):  # plain transfer loses nearly all that rings on any of these
        require(f"{way}: less rings away on finer cells", all(a > b for a, b in zip(lost, lost[1:])))
    require(f"{way}: nothing is gained", min(lost) > -0.002)
print(f"| sideways momentum | {' | '.join(f'{n} cells' for n in counts[:2])} |")
for way in ("affine", "plain", "affine, corners"):
    spread = [sticking(n, way) for n in counts[:2]]
    print(f"| {way} | " + " | ".join(f"{100 * s:.1f} %" for s in spread) + " |", flush=True)
    require(f"{way}: less on finer cells", all(a > b for a, b in zip(spread, spread[1:])))
finish()
