"""Quasi-static steps with tools that loads push, and with friction, against exact answers (theory.md,
Quasi-static steps). usage: pushed.py (in an empty directory; GIMP3D is the program)"""

from pathlib import Path

import numpy as np

from static_scenes import History, check, counts, finish, first_particles, last_particles, require, run, tool

YOUNG, WEIGHT = 4e5, 4.0  # Pa, kg
BLOCK = (
    "&grid lower=0,0,0, upper=0.6,0.4,0.4, cell_size=0.05 /\n"
    f"&material name='rubber', model='neo_hookean', density=1000, young={YOUNG}, poisson=0 /\n"
    "&body material='rubber', shape='box', lower=0.1,0.1,0.1, upper=0.3,0.3,0.2 /\n"
)


def ball(name, motion, more=""):
    return (
        f"&scene title='{name}', end_time=2 /\n"
        "&grid lower=0,0,0, upper=12,12,7, cell_size=1, "
        "boundary='symmetry','free','symmetry','free','fixed','free' /\n"
        "&material name='soft', model='elastic', density=0.1, young=1, poisson=0.3 /\n"
        "&body material='soft', shape='box', lower=0,0,0, upper=9,9,4 /\n"
        f"&tool name='ball', shape='sphere', radius=6, {motion} /\n"
        f"&time domain='stretch' /\n&quasi_static step=0.2, max_step=0.2 /\n&output directory='{name}' "
        f"/\n{more}"
    )


def load_and_depth():
    """A ball that a load pushes: it comes to the body at once, bears just this load, leaves when the load is
    0; on 1, 2 and 4 ranks the same. A ball that is moved to the depth that it had at the most bears that
    load."""
    depths = {}
    for ranks in (1, 2, 4):
        run(ball(f"pushed_{ranks}", "tip=0,0,4.7, times=0,1,2, loads=0,0.5,0, mass=1"), ranks)
        history = tool(f"pushed_{ranks}", "ball")
        depths[ranks] = history["depth"]
        given = np.interp(history["time"], (0, 1, 2), (0, 0.5, 0))
        check(
            f"pushed, {ranks} ranks: load against the given one, of the largest",
            (history["load_z"] - given) / 0.5,
            1e-5,
        )
    require(
        "pushed: nothing presses when the load is 0",
        history["load_z"][-1] == 0.0 and history["load_x"][-1] == 0.0,
    )
    for ranks in (2, 4):
        check(f"pushed: depth on {ranks} ranks against 1, cells", depths[ranks] - depths[1], 1e-5)
    most = depths[1].max() - 0.7
    run(ball("moved", f"tip=0,0,4, times=0,1,1.0001, speeds={most},{most},0"), 1)
    history = tool("moved", "ball")
    check(
        "moved to that depth: load, relative",
        np.interp(1.0, history["time"], history["load_z"]) / 0.5 - 1,
        0.01,
    )
    log = run(
        ball("beside", "tip=11,11,5, times=0, loads=0.5, mass=1").replace("radius=6", "radius=1"),
        1,
        allowed=(3,),
    )
    said = "tool ball: no equilibrium under its load: nothing holds it"
    require("pushed past the body: the sentence names the tool", said in log)


def plate(load):
    """A block of norton between rollers under a plate with a constant load: elastic strain, and creep at the
    law's rate."""
    name = f"plate_{load}"
    area, height, stress, rate, time = 0.2, 0.5, 1e-3, 1e-4, 5.0
    run(
        f"&scene title='{name}', end_time={time + 1e-3} /\n"
        "&grid lower=0,0,0, upper=0.8,0.8,0.9, cell_size=0.1, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        f"&material name='metal', model='norton', density=1, young=1, poisson=0.3, creep_stress={stress}, "
        f"creep_rate={rate}, creep_exponent=3 /\n"
        "&body material='metal', shape='box', lower=0,0,0, upper=0.4,0.5,0.5 /\n"
        "&tool name='plate', shape='flat', radius=2, tip=0,0,0.5, times=0,1e-3, "
        f"loads=0,{load * stress * area}, mass=1 /\n"
        "&time domain='stretch' /\n&contact compliance=1e-5 /\n"
        f"&quasi_static step=1e-3 /\n&output directory='{name}', history_every=1e-9 /\n",
        1,
    )
    history = tool(name, "plate")
    held = history["time"] > 1.0001e-3
    speed = np.polyfit(history["time"][held], history["depth"][held], 1)[0] / height
    check(
        f"constant load {load}: rate of the depth against the law's, relative",
        speed / (rate * load**3) - 1,
        0.01,
    )
    return speed


def slides_and_sticks():
    """A block under its weight: on an incline that is rough enough it stays, on one that is not there is no
    equilibrium; pushed over a floor its wall meets friction times weight, however far it goes, and the heat
    is that times the way."""
    incline = (
        "&scene title='incline', end_time=1 /\n"
        + BLOCK
        + "&gravity acceleration=4.145885167,0,-8.890879385 /\n"
        "&tool name='floor', shape='flat', radius=10, tip=0.3,0.2,0.1, axis=0,0,1, times=0, speeds=0, "
        "penetration_factor=0.5,"
        " friction={friction} /\n&quasi_static step=0.25, max_step=0.25, ramp=0.5 /\n&output "
        "directory='incline_{friction}' /\n"
    )
    run(incline.format(friction=0.6), 1)
    floor = tool("incline_0.6", "floor")
    check(
        "rough incline: load along it over that across, against the tangent",
        floor["load_x"][-1] / -floor["load_z"][-1] - np.tan(np.radians(25)),
        1e-5,
    )
    way = last_particles("incline_0.6")["position"] - first_particles("incline_0.6")["position"]
    check("rough incline: way along it over the block's edge", way[:, 0], 2e-3)
    log = run(incline.format(friction=0.4), 1, allowed=(3,))
    require("smoother incline: no equilibrium", "no equilibrium" in log)
    for ranks in (1, 2):
        log = run(
            "&scene title='floor', end_time=1 /\n" + BLOCK + "&gravity acceleration=0,0,-9.81 /\n"
            "&tool name='floor', shape='flat', radius=10, tip=0.3,0.2,0.1, axis=0,0,1, times=0, speeds=0,"
            " penetration_factor=0.5, friction=0.3 /\n"
            "&tool name='wall', shape='flat', radius=10, tip=0.1,0.2,0.2, axis=1,0,0, times=0,0.2,0.2001,"
            " speeds=0,0,0.05, penetration_factor=0.5 /\n"
            f"&quasi_static step=0.1, max_step=0.1, ramp=0.2 /\n&output directory='floor_{ranks}' /\n",
            ranks,
        )
        wall = tool(f"floor_{ranks}", "wall")
        moved = wall["time"] > 0.25
        check(
            f"pushed over a floor, {ranks} ranks: load over friction times weight",
            wall["load_x"][moved] / (-0.3 * WEIGHT * 9.81) - 1,
            1e-5,
        )
        energy = History(Path(f"floor_{ranks}/energy.dat"))
        heat = (energy["damped"][-1] - energy["damped"][moved][0]) / (
            wall["depth"][-1] - wall["depth"][moved][0]
        )
        check(
            f"pushed over a floor, {ranks} ranks: heat over friction times weight times way",
            heat / (0.3 * WEIGHT * 9.81) - 1,
            1e-3,
        )
        require("pushed over a floor: no step is halved", counts(log)[4] == 0)


if __name__ == "__main__":
    load_and_depth()
    slow, fast = plate(1.0), plate(1.5)
    check(
        "constant load: exponent of creep against 3, relative",
        np.log(fast / slow) / np.log(1.5) / 3 - 1,
        0.01,
    )
    slides_and_sticks()
    finish()
