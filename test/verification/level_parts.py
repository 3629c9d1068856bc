"""Levels whose region is a ball of cells, or two boxes that overlap, or two that only touch: the load on a
ball that is pressed into an elastic block is that of the box that contains them within 1 %, with fewer cells;
mass and bits on two ranks as always."""

import shutil
import subprocess
import sys
from pathlib import Path

from gimp3d.run_data import History
from gimp3d.run_log import facts_of

GIMP3D, MPIRUN = sys.argv[1], sys.argv[2:]
BOX = "&level lower=0,0,2, upper=6,6,11 /"
PARTS = {
    "ball": "&level shape='sphere', radius=5, follow='ball' /",
    "shell": "&level shape='sphere', center=0,0,8, radius=5.5, inner_radius=0.5 /",
    "overlapping": "&level lower=0,0,2, upper=4,4,11 / &level of=1, lower=0,0,4, upper=6,5,11 /",
    "touching": "&level lower=0,0,2, upper=5,5,6 / &level of=1, lower=0,0,6, upper=6,6,11 /",
    "apart": "&level lower=0,0,2, upper=5,5,11 / &level of=1, lower=7,7,3, upper=11,11,7 /",
}
SCENE = """&scene title='ball', end_time=0.5 /
&grid lower=0,0,0, upper=11,11,11, cell_size=1, boundary='symmetry','free','symmetry','free','roller','free' /
{level}
&material name='m', model='elastic', density=1, young=1000, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=10,10,8, particles_per_cell=8 /
&tool name='ball', shape='sphere', radius=4, tip=0,0,8, times=0,0.1,1, speeds=0,0.9,0.9 /
&output directory='{name}', formats='none' /
"""


def run(name, level, ranks=1):
    """Load (N) over depth at equal times, and the level's cells."""
    shutil.rmtree(name, ignore_errors=True)
    Path(f"{name}.nml").write_text(SCENE.format(name=name, level=level))
    command = [GIMP3D] if ranks == 1 else [*MPIRUN, "-n", str(ranks), GIMP3D]
    done = subprocess.run(command, input=Path(f"{name}.nml").read_text(), text=True, capture_output=True)
    if done.returncode:
        sys.exit(f"{name} ends with status {done.returncode}: {done.stderr}")
    rows = History(Path(name, "tool_ball.dat"))
    late = rows["time"] > 0.3  # waves have been through
    return rows["load_z"][late].mean(), int(facts_of(Path(name, "cost.dat"))["cells_level_2"])


load, cells = run("box", BOX)
print(f"   box: {load:.5g} N, {cells} cells")
failed = False
for name, level in PARTS.items():
    other, fewer = run(name, level)
    off = other / load - 1
    good = abs(off) < 0.01 and fewer < cells
    failed |= not good
    print(f"   {'' if good else 'FAILED: '}{name}: {100 * off:+.3f} %, {fewer} cells")
again, _ = run("ball_on_two", PARTS["ball"], ranks=2)
once, _ = run("ball", PARTS["ball"])
print(f"   ball on two ranks: {again / once - 1:+.1e}")
near = SCENE.format(
    name="near",
    level="&level shape='sphere', center=5,5,5, radius=3 / &level lower=2.5,2.5,2.5, upper=7.5,7.5,7.5 /",
)
done = subprocess.run([GIMP3D], input=near, text=True, capture_output=True)
said = (
    "line 3, &level: the level reaches (2.75,2.75,2.75) m, less than 2 cells of 500 mm inside the edge of "
    "level 2, which it refines"
)
if done.returncode != 2 or said not in done.stderr or Path("near").exists():
    failed = True
    print(f"   FAILED: too near: status {done.returncode}, {done.stderr}")
sys.exit(1 if failed or abs(again / once - 1) > 1e-6 else 0)
