"""A block whose surface lies on a plane of nodes is pulled up by 1e-22 of a cell, then pressed in its middle.
The nodes above are no unknowns: products are those of a block that is pushed down as much. With them as
unknowns it takes 5 % more.

Metal that a cylinder presses and leaves, with inertia: nodes that a particle hardly reaches have 1e-13 of
the others' stiffness, which changes with every step. With the diagonal of another step as preconditioner a
solve takes thousands of products, or does not end. usage: cut_cells.py (in an empty directory; GIMP3D is the
program)"""

from static_scenes import check, counts, finish, run

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
    return counts(log)[3]


lifted = products("lifted", "-1e-13")  # Pa
pressed = products("pressed", "1e-13")
check("products a step, pulled up over pushed down", lifted / pressed - 1, 0.02)

METAL = """&scene title='metal that a cylinder presses, implicit with inertia', end_time=1 /
&grid lower=0.925,0,-1.11, upper=2.405,1.85,1.11, cell_size=0.37,
boundary='free','symmetry','roller','symmetry','symmetry','free' /
&material name='metal', model='j2', density=38100, young=3.875e5, poisson=0.3, yield_stress=465,
hardening_modulus=3875 /
&body material='metal', shape='box', particles_per_cell=8, lower=1.295,0,-1.11, upper=2.405,1.85,0.37 /
&tool name='rod', shape='cylinder', tip=1.85,1.8128,0.37, axis=0,0,-1, times=0,0.25,1, speeds=0,0.0185,-0.0185,
radius=1.226, edge=1,0,0 /
&gravity acceleration=0,0,-0.001374 /
&quasi_static mode='newmark', step=0.1 /
&output directory='metal', formats='none' /
"""
log = run(METAL, 1)
check("metal with inertia: products a step", counts(log)[3], 100)
check("metal with inertia: steps that are halved", counts(log)[4], 0)
finish()
