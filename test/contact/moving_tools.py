"""Runs of contact/moving_tools.sh: a ball that is dragged under a load and turns freely, and a cylinder that
turns at a given speed where it stands, on a block of elastic material."""

import os
import subprocess
from pathlib import Path

from runs import *

CELL = 0.1
SCENE = """
&scene    title='moving tools', end_time={end} /
&grid     lower=-0.9,-0.3,0, upper=0.9,0.3,0.8, cell_size={cell}, boundary='roller','roller','roller','roller','fixed','free' /
{level}
&time     time_step=2.4e-3 /
&contact  tolerance=1e-10 /
&material name='soft', model='neo_hookean', density=1000, young=1e5, poisson=0.3 /
&body     material='soft', shape='box', lower=-0.9,-0.3,0, upper=0.9,0.3,0.3 /
&tool     name='ball', shape='sphere', radius=0.25, tip={x_ball},0.02,0.3, times=0,0.1, loads=0,200, mass=20, friction=0.3 /
&motion   tool='ball', kind='slide', axis=1,0,0, times=0.05,0.1, speeds=0,{speed} /
&motion   tool='ball', kind='turn', axis=0,1,0, point={x_ball},0.02,0.55, times=0, loads=0, inertia=0.5 /
{mill}&tool name='mill', shape='cylinder', radius=0.25, edge=0,1,0, tip={x_mill},0,0.3, times=0,0.1,0.15, speeds=0,0.2,0, friction=0.3 /
{mill}&motion tool='mill', kind='turn', axis=0,1,0, point={x_mill},0,0.55, times=0.1,0.2, speeds=0,{spin} /
{checkpoint}
&output   directory='{name}', every=0.1, history_every=2.4e-3, formats='hdf5' /
"""
LEVEL = "&level lower=-0.6,-0.3,0, upper=0,0.3,0.8, follow='ball' /"


def scene(name, end=0.24, mirror=1, level="", checkpoint=""):
    text = SCENE.format(
        end=end,
        cell=CELL,
        x_ball=-0.4 * mirror,
        speed=0.8 * mirror,
        x_mill=0.5 * mirror,
        spin=-1.5 * mirror,
        name=name,
        level=level,
        mill="!" if level else "",
        checkpoint=checkpoint,
    )
    Path(f"{name}.nml").write_text(text)
    return f"{name}.nml"


def run(ranks, file=os.devnull, restart=None):
    command = ["mpirun", "-n", str(ranks), os.environ["GIMP3D"]] + (["--restart", restart] if restart else [])
    with open(file) as text, open(f"{Path(file).name}_{ranks}.log", "w") as log:
        done = subprocess.run(command, stdin=text, stdout=log, stderr=subprocess.STDOUT)
    require(f"{file} on {ranks} ranks: status {done.returncode}", done.returncode == 0)


def tool(run_name, name):
    return History(Path(run_name) / f"tool_{name}.dat")


def compared(what, first, second, bound, signs=None):
    """Two runs, all columns of both tools but the contact area, which is read off the points at the surface:
    a column's largest difference, of its largest value and of what there is of its kind."""
    worst = 0.0
    for name in ("ball", "mill"):
        a, b = tool(first, name), tool(second, name)
        require(f"{what}: rows", a.rows >= b.rows > 45)
        for column in a.columns:
            if column in ("contact_area", "max_gap_violation"):
                continue
            kind = column.rsplit("_", 1)[0]
            scale = max(np.abs(a[other]).max() for other in a.columns if other.rsplit("_", 1)[0] == kind)
            sign = -1 if signs and column in signs else 1
            if scale > 0:
                worst = max(worst, np.abs(a[column][: b.rows] - sign * b[column]).max() / scale)
    check(what, worst, bound)


run(1, scene("straight"))
ball, mill, balance = tool("straight", "ball"), tool("straight", "mill"), energy("straight")
late = ball["time"] > 0.2
surface = ball["velocity_x"] - 0.25 * ball["spin_y"]
check(
    "the ball rolls: speed of its surface over its own",
    np.mean(surface[late]) / np.mean(ball["velocity_x"][late]),
    0.2,
)
require("the ball turns the right way", np.all(ball["spin_y"][late] > 0.5))
turned = 2 * np.arctan2(ball["rotation_y"], ball["rotation_w"])
check(
    "its rotation is the integral of its spin",
    turned[1:] - np.cumsum(ball["spin_y"][1:] * np.diff(ball["time"])),
    1e-12,
)
check("its depth is that of its point", ball["depth"] + (ball["position_z"] - ball["position_z"][0]), 1e-14)
check("the cylinder is turned as given", mill["spin_y"][mill["time"] > 0.21] + 1.5, 1e-12)
rows = mill["time"] > 0.21
require(
    "the cylinder rubs: its moment works against its turn",
    np.all(mill["moment_y"][rows] * mill["spin_y"][rows] < 0),
)
check("energy balance at the end", balance["balance_error"][-1], 0.1)

# the mirror image in x: components of vectors along it, and of turns across it, change sign
run(1, scene("mirrored", mirror=-1))
compared(
    "mirrored",
    "straight",
    "mirrored",
    1e-8,
    {
        "load_x",
        "position_x",
        "velocity_x",
        "rotation_y",
        "rotation_z",
        "spin_y",
        "spin_z",
        "moment_y",
        "moment_z",
    },
)

for ranks in (2, 4):
    run(ranks, scene(f"ranks_{ranks}", end=0.12))
    compared(f"on {ranks} ranks", "straight", f"ranks_{ranks}", 1e-8)

# a level that follows the ball; the run goes on from a checkpoint before its end
run(1, scene("level", level=LEVEL, end=0.192, checkpoint="&checkpoint every=0.096 /"))
with h5py.File(sorted(Path("level").glob("checkpoint_*.h5"))[-1]) as file:
    require("the level has moved", file["state/counts"][1] > 0)
far = tool("level", "ball")
check(
    "with a level: loads beside those without",
    np.mean(far["load_z"][-20:]) / np.mean(ball["load_z"][far.rows - 20 : far.rows]) - 1,
    0.3,
)
sorted(Path("level").glob("checkpoint_*.h5"))[-1].unlink()
run(1, restart="level")
again = tool("level", "ball")
require(
    "restart: the same bits",
    far.rows == again.rows and all(np.array_equal(far[name], again[name]) for name in far.columns),
)
require("restart: it went on", "goes on" in Path("level/run.log").read_text())
finish()
