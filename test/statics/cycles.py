"""A ball pressed into a soft metal, drawn back a little, pressed deeper, drawn back, in 500 quasi-static
steps: none is halved, none needs more than 6 Newton iterations; the same in fewer steps. usage: cycles.py (in
an empty directory; GIMP3D is the program)"""

import numpy as np

from static_scenes import check, counts, finish, newton_by_step, require, run, tool

SCENE = """&scene    title='ball into a soft metal', end_time=500 /
&grid     lower=0,0,0, upper=12,12,10, cell_size=1, boundary='symmetry','free','symmetry','free','fixed','free' /
&material name='metal', model='j2', density=1, young=1, poisson=0.3, yield_stress=0.01, hardening_modulus=0.02 /
&body     material='metal', shape='box', lower=0,0,0, upper=9,9,7 /
&tool     name='ball', shape='sphere', radius=10, tip=0,0,7, times=0,200,200.001,260,260.001,440,440.001,500,
          speeds=0.01,0.01,-0.004,-0.004,0.009,0.009,-0.004,-0.004 /
&time     domain='stretch' /
&quasi_static step={step}, max_step={step}, iterations=.true. /
&output   directory='cycles_{step}' /
"""

if __name__ == "__main__":
    loads = {}
    for step in (1, 10):
        log = run(SCENE.format(step=step), 1)
        iterations = np.array(newton_by_step(log))
        print(
            f"   steps of {0.01 * step} cells: Newton iterations {np.bincount(iterations)} times 0, 1, 2 ..."
        )
        require(f"step {step}: none is halved", counts(log)[4] == 0)
        require(f"step {step}: all steps are there", len(iterations) >= 500 / step)
        check(f"step {step}: Newton iterations of a step", iterations, 6)
        history = tool(f"cycles_{step}", "ball")
        loads[step] = np.interp((200, 440), history["time"], history["load_z"])
        lifted = history["load_z"][-1]
        require(f"step {step}: drawn back, it bears less", lifted < loads[step][1])
    check("load at both depths with ten times the step, relative", loads[10] / loads[1] - 1, 0.02)
    finish()
