"""A sphere into a viscoelastic body (maxwell), and held. As long as the contact does not shrink, the load is
the elastic one at the present depth with its growth weighed by the relaxation function (Lee and Radok 1960),
on any body whose Poisson's ratio stays. The elastic load comes from a run on the same body and grid, through
a fit over depth that leaves out its ringing."""

from pathlib import Path

import numpy as np
from run_scene import History, run
from checks import check, finish, require

TAU, RATIO = 2e-8, 0.5
SCENE = """&scene title='sphere into a viscoelastic cylinder', end_time=9e-8 /
&grid lower=0,0,0, upper=21e-6,21e-6,22e-6, cell_size=1e-6, boundary='symmetry','free','symmetry','free','roller','free' /
&time domain='fixed' /
&material name='polymer', density=2710, young=70e9, poisson=0.33, %s /
&body material='polymer', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6, particles_per_cell=8 /
&tool name='sphere', shape='sphere', radius=10e-6, tip=0,0,20e-6, axis=0,0,-1, times=0,1e-8,2.5e-8,3.5e-8, speeds=0,20,20,0,
      penetration_factor=0.5 /
&output directory='%s', formats='none' /
"""


def curve(name, law):
    run(SCENE % (law, name), 1)
    rows = History(Path(name) / "tool_sphere.dat")
    return rows["time"], rows["depth"], np.abs(rows["load_z"])


time, depth, load = curve("elastic", "model='elastic'")
powers = np.stack([depth**p for p in (1.5, 2.0, 2.5)], axis=1)
late = time > 0.8e-8
fitted = powers @ np.linalg.lstsq(powers[late], load[late], rcond=None)[0]
own_time, _, own = curve(
    "maxwell", f"model='maxwell', relaxation_times={TAU}, shear_ratios={RATIO}, bulk_ratios={RATIO}"
)
for moment in (2e-8, 3e-8, 4e-8, 6e-8, 8.5e-8):
    n = np.count_nonzero(time <= moment)
    since = moment - 0.5 * (time[1:n] + time[: n - 1])
    exact = np.sum((1 - RATIO * (1 - np.exp(-since / TAU))) * np.diff(fitted[:n]))
    near = np.abs(own_time - moment) < 1.2e-9
    check(f"load at {moment:g} s over that of Lee and Radok, less 1", own[near].mean() / exact - 1, 0.03)
require("it relaxes much", own[-1] < 0.65 * fitted[-1])
finish()
