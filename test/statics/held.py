"""A cone pressed into metal by quasi-static steps and held: what the linear problems take once the metal has
flowed. usage: held.py (in an empty directory; GIMP3D is the program)"""

import re

from static_scenes import check, finish, run, tool

scene = """&scene title='cone pressed into metal, held', end_time=2 /
&grid lower=0,0,0, upper=11e-6,11e-6,9e-6, cell_size=0.5e-6,
      boundary='symmetry','free','symmetry','free','roller','free' /
&material name='metal', model='j2', density=2700, young=70e9, poisson=0.3, yield_stress=7e8 /
&body material='metal', shape='box', lower=0,0,0, upper=8e-6,8e-6,7e-6, particles_per_cell=8 /
&tool name='cone', shape='cone', half_angle=70.3, tip=0,0,7e-6,
      times=0,0.9999,1.0001,2, speeds=0.75e-6,0.75e-6,0,0 /
&quasi_static step=0.2, iterations=.true. /
&output directory='held', formats='none' /
"""

log = run(scene, 1)
products = [0]
for line in log.splitlines():
    counted = re.match(r"newton +(\d+):.* (\d+) products", line)
    if counted and counted[1] == "0":
        products.append(0)
    elif counted:
        products[-1] = int(counted[2])
# conjugate gradients alone: 4000 in each of the linear problems of the hold, which they do not solve
check("products of the costliest step", max(products), 2000)
history = tool("held", "cone")
load, time = -history["load_z"], history["time"]
check("load at rest: the last against the first, relative", load[-1] / load[time > 1.0001][0] - 1, 1e-2)
finish()
