"""A block whose surface lies on a plane of nodes is pulled up by 1e-22 of a cell, then pressed in its middle.
The nodes above are no unknowns: products are those of a block that is pushed down as much. With them as
unknowns it takes 5 % more. usage: cut_cells.py (in an empty directory; GIMP3D is the program)"""

import re

from static_scenes import check, finish, run

scene = """&scene title='cut by round-off', end_time=4 /
&grid lower=0,0,0, upper=8,8,8, cell_size=1, boundary='free','free','free','free','fixed','free' /
&material name='m', model='elastic', density=1, young=1e9, poisson=0.3 /
&body material='m', shape='box', lower=1,1,0, upper=7,7,5, particles_per_cell=8 /
&pressure lower=1,1,5, upper=7,7,5, times=0,1,1.0001,4, values=0,{pull},0,0 /
&pressure lower=2,2,5, upper=5,5,5, times=0,1,4, values=0,0,3e7 /
&time domain='corners' /
&quasi_static step=1, max_step=1 /
&output directory='{name}', formats='none' /
"""


def products(name, pull):
    log = run(scene.format(name=name, pull=pull), 1)
    return float(re.search(r"([\d.]+) products a step", log)[1])


lifted = products("lifted", "-1e-13")  # Pa
pressed = products("pressed", "1e-13")
check("products a step, pulled up over pushed down", lifted / pressed - 1, 0.02)
finish()
