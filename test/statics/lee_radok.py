"""A sphere into a viscoelastic body (maxwell), and held, by quasi-static steps. As long as the contact does not
shrink, the load is the elastic one at the present depth with its growth weighed by the relaxation function
(Lee and Radok 1960), on any body whose Poisson's ratio stays. The elastic load comes from the same body and
grid; with the compliance below the cells, which relaxes too. The same of a ball on a block, both viscoelastic.
usage: lee_radok.py (in an empty directory; GIMP3D is the program)"""

import numpy as np

from static_scenes import History, check, finish, require, run, tool

TAU, RATIO = 2.0, 0.5  # s
SCENE = """&scene title='sphere into a viscoelastic cylinder', end_time={end} /
&grid lower=0,0,0, upper=22e-6,22e-6,22e-6, cell_size=2e-6, boundary='symmetry','free','symmetry','free','roller','free' /
&time domain='stretch' /
&material name='polymer', density=2710, young=70e9, poisson=0.33, {law} /
&body material='polymer', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6 /
&tool name='sphere', shape='sphere', radius=10e-6, tip=0,0,20e-6, times=0,1,2.5,3.5, speeds=0,2e-7,2e-7,0 /
&quasi_static step={step}, max_step={step} /
&output directory='{name}', formats='none' /
"""
PAIR = """&scene title='ball on a block, both viscoelastic', end_time={end} /
&grid geometry='axisymmetric', lower=0,0,0, upper=24e-6,2e-6,44e-6, cell_size=2e-6,
      boundary='symmetry','free','symmetry','symmetry','roller','free' /
&time domain='stretch' /
&material name='polymer', density=2710, young=70e9, poisson=0.33, {law} /
&body material='polymer', shape='box', lower=0,0,0, upper=20e-6,2e-6,20e-6, contact_group='block' /
&body material='polymer', shape='sphere', center=0,0,30e-6, radius=10e-6, contact_group='ball' /
&body_contact groups='block','ball' /
&tool name='sphere', shape='flat', radius=30e-6, tip=0,0,40e-6, times=0,1,2.5,3.5, speeds=0,2e-7,2e-7,0 /
&quasi_static step={step}, max_step={step} /
&output directory='{name}', formats='none' /
"""
MAXWELL = f"model='maxwell', relaxation_times={TAU}, shear_ratios={RATIO}, bulk_ratios={RATIO}"


def loads(scene, name, law, step, end):
    run(scene.format(name=name, law=law, step=step, end=end), 1)
    return tool(name, "sphere")


def exact_at(moment, elastic):
    """By an integral over many short times, in which the depth grows evenly between rows."""
    time = np.linspace(0, moment, 4001)
    since = moment - 0.5 * (time[1:] + time[:-1])
    grown = np.diff(np.interp(time, elastic["time"], elastic["load_z"]))
    return np.sum((1 - RATIO * (1 - np.exp(-since / TAU))) * grown)


def compare(what, scene, bounds):
    """`bounds`: moment (s): how far the load may be off."""
    name = what.split()[0]
    elastic = loads(scene, f"{name}_elastic", "model='elastic'", 0.1, 3.5)
    own = loads(scene, f"{name}_maxwell", MAXWELL, 0.2, 9)
    for moment, bound in bounds.items():
        load = np.interp(moment, own["time"], own["load_z"])
        check(
            f"{what}: load at {moment} s over that of Lee and Radok, less 1",
            load / exact_at(moment, elastic) - 1,
            bound,
        )
    require(f"{what}: it relaxes much", own["load_z"][-1] < 0.65 * elastic["load_z"].max())
    balance, same = (
        History(f"{name}_{law}/energy.dat")["balance_error"][-1] for law in ("maxwell", "elastic")
    )
    check(f"{what}: energy, with what relaxes below the cells, over that of elastic", balance - same, 0.008)


LONG = """&scene title='sphere held for five relaxation times', end_time=101 /
&grid geometry='axisymmetric', lower=0,0,0, upper=12e-6,0.6e-6,12e-6, cell_size=0.6e-6,
      boundary='symmetry','free','symmetry','symmetry','roller','free' /
&time domain='stretch' /
&material name='polymer', model='maxwell', density=1200, young=3e9, poisson=0.35, relaxation_times=1,20,
      shear_ratios=0.3,0.4 /
&body material='polymer', shape='box', lower=0,0,0, upper=9e-6,0.6e-6,9e-6 /
&tool name='ball', shape='sphere', radius=20e-6, tip=0,0,9e-6, times=0,0.1,0.1001, speeds=5e-6,5e-6,0 /
&quasi_static step=0.02, max_step=1 /
&output directory='long', formats='none' /
"""


def held_long():
    """Most of the stress relaxes; the iterations have to converge all the same."""
    run(LONG, 1)
    load = tool("long", "ball")["load_z"]
    require("held for five relaxation times: it relaxes to less than half", load[-1] < 0.5 * load.max())


if __name__ == "__main__":
    held_long()
    compare("sphere into a cylinder", SCENE, {2: 0.01, 3: 0.01, 4: 0.004, 6: 0.004, 8.5: 0.004})
    compare("ball on a block", PAIR, {2: 0.015, 3: 0.015, 4: 0.01, 6: 0.01, 8.5: 0.01})
    finish()
