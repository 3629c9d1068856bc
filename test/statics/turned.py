"""Quasi-static steps of one scene along three axes of the grid: the ghost penalty's modulus must turn with
the scene (theory.md, eq. ghost-modulus). usage: turned.py (in an empty directory; GIMP3D is the program)"""

import numpy as np

from static_scenes import History, check, require, finish, run

CELL, YOUNG, END = 0.125, 1e6, 0.2
LAWS = {
    "norton": "creep_stress=1e4, creep_rate=0.05, creep_exponent=3",
    "j2": "yield_stress=1e4, hardening_modulus=2e4",
    "maxwell": "relaxation_times=0.2,1, shear_ratios=0.3,0.3",
}


def scene(law, name, axes):
    """A block on a fixed side, sheared by its far end. Its x, y, z lie along the grid's axes `axes`."""

    def listed(values):
        return ",".join(repr(value) for _, value in sorted(zip(axes, values)))

    sides = [["'free'", "'free'"], ["'free'", "'free'"], ["'fixed'", "'free'"]]
    boundary = ", ".join(",".join(pair) for _, pair in sorted(zip(axes, sides)))
    size = np.multiply(CELL, [2, 3, 2]).tolist()
    return f"""&scene title='{name}', end_time={END} /
&time domain='stretch' /
&grid lower={listed([-0.5, -0.5, 0.0])}, upper={listed([1.0, 1.0, 1.0])}, cell_size={CELL},
      boundary={boundary} /
&material name='m', density=1000, model='{law}', young={YOUNG}, poisson=0.3, {LAWS[law]} /
&body material='m', shape='box', lower=0,0,0, upper={listed(size)} /
&anti_locking kind='none' /
&pressure lower={listed([0.0, 0.0, size[2]])}, upper={listed(size)}, times=0,0.3, values=0,1e4,
          traction={listed([1.0, 0.5, 0.2])} /
&quasi_static step=0.1, max_step=0.1, tolerance=1e-10 /
&output directory='{name}', formats='none', history_every=0.05 /
"""


def work(law, axes):
    name = f"{law}_{''.join('xyz'[axis] for axis in axes)}"
    run(scene(law, name, axes), 1)
    return History(f"{name}/energy.dat")["external_work"]


def turned():
    for law in LAWS:
        first = work(law, (0, 1, 2))
        require(f"{law}: the block is loaded in more than one step", len(first) > 2 and first[-1] > 0)
        for axes in ((1, 2, 0), (2, 0, 1)):
            off = work(law, axes) / first[-1] - first / first[-1]
            check(f"{law}, z along {'xyz'[axes[2]]}: work of the load, relative", off, 1e-9)


turned()
finish()
