"""One particle per cell in quasi-static steps: modes of deforming corners that only the ghost penalty holds creep
with each step. A block under a wedge: the share of the work that is dissipated."""

from checks import check, finish, require
from run_scene import run
from runs import energy

SCENE = """&scene title='{name}', end_time=1 /
&grid geometry='plane_strain', lower=0,0, upper=0.9,1, cell_size=0.1, boundary='symmetry','free','roller','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=0.5,0.1,0.4, particles_per_cell={particles} /
&tool name='t', shape='wedge', tip=0,0,0.401, axis=0,0,-1, edge=0,1,0, half_angle=70.3, friction=0.3,
      times=0,0.6, speeds=0.071,0 /
&quasi_static step={step}, max_step={step} /
&output directory='{name}', formats='none' /
"""


def dissipated(name, **values):
    run(SCENE.format(name=name, **values), 1)
    rows = energy(name)
    return rows["damped"][-1] / rows["particle_work"].max()


creeps = [
    dissipated(f"corners_{n}", domain="corners", particles=1, step=step)
    for n, step in ((20, 0.05), (80, 0.0125))
]
print(f"   corners, one a cell: {creeps[0]:.3f} of the work in 20 steps, {creeps[1]:.3f} in 80")
require("corners, one a cell: it creeps", creeps[0] > 0.1 and creeps[1] > creeps[0])
for name, domain, particles in (("stretch", "stretch", 1), ("eight", "corners", 8)):
    share = dissipated(name, domain=domain, particles=particles, step=0.05)
    check(f"{name}: dissipated, of the work", share, 0.03)
finish()
