"""A column of water flies against a plane at 200 m/s: behind the shock the pressure is rho Us up, with
Us = c + s up. The column is one cell wide between planes of symmetry, so that the row of nodes inside of each
is the other one. usage: water_hammer.py (in an empty directory; GIMP3D is the program)"""

import numpy as np
from checks import check, finish, require
from run_scene import run
from runs import snapshots

SCENE = """&scene title='water hammer', end_time=6e-5 /
&grid {grid}, cell_size={cell} /
&material name='water', model='mie_grueneisen', density=1000, sound_speed=1480, hugoniot_slope=1.9,
      grueneisen=0.1 /
&body material='water', shape='box', lower=0,0,0, upper={cell},{cell},200e-3, velocity=0,0,-200 /
&bulk_viscosity /
&output directory='{name}' /
"""
SIDES = "'symmetry','symmetry','symmetry','free'"
COLUMN = f"lower=0,0,0, upper={{0}},{{0}},220e-3, boundary='symmetry','symmetry',{SIDES}"
SLICE = f"geometry='plane_strain', lower=0,0, upper={{0}},220e-3, boundary={SIDES}"
PRESSURE = 1000 * (1480 + 1.9 * 200) * 200  # Pa

for name, grid, cell in (("column", COLUMN, 2e-3), ("fine", COLUMN, 1e-3), ("slice", SLICE, 1e-3)):
    run(SCENE.format(name=name, grid=grid.format(cell), cell=cell), 1)
    last = snapshots(name)[-1].fields
    behind = (last["position"][:, 2] > 0.02) & (last["position"][:, 2] < 0.06)
    require(f"{name}: particles behind the shock", np.count_nonzero(behind) > 100)
    mean = -last["stress"][behind, :3].mean()
    check(f"{name}: pressure behind the shock over that of the jump, less 1", mean / PRESSURE - 1, 0.01)
    # rounding alone moved them, by up to a tenth to four times the speed of the impact
    check(f"{name}: largest speed sideways, m/s", np.abs(last["velocity"][:, :2]).max(), 1e-6)
finish()
