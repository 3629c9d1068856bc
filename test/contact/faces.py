"""Where a body's sides stand in their cells does not matter to what a tool does to it (theory.md, eq.
face-mean), in steps of any kind. usage: faces.py (in an empty directory; GIMP3D is the program)"""

import numpy as np
from checks import check, finish
from run_scene import run
from runs import History, snapshots

PLATE = """&scene title='{name}', end_time={end} /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.1, boundary='free','free','free','free','roller','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density=1000, young=1e9, poisson=0.3 /
&body material='m', shape='box', lower={low},{low},0, upper={high},{high},0.45 /
&tool name='plate', shape='flat', radius=9, tip=0.5,0.5,0.45, {motion} /
{steps}
&output directory='{name}', every={end}, history_every=1e-9 /
"""
EXPLICIT = {
    "end": 4e-3,
    "motion": "times=0,5e-4,1e-3, speeds=0,8,0",
    "steps": "&damping kind='viscous', coefficient=20000 /",
}
IMPLICIT = {
    "end": 1,
    "motion": "times=0, speeds=0.004",
    "steps": "&quasi_static step=0.25, max_step=0.25, tolerance=1e-9 /",
}


def plates():
    """A block under a plate: one stress in its first layer, one load, wherever the planes of nodes are."""
    for kind, steps, bound in (("explicit", EXPLICIT, 0.03), ("implicit", IMPLICIT, 0.01)):
        for domain in ("fixed", "corners"):
            loads = []
            for off in (0.0, 0.025):
                name = f"{kind}_{domain}_{off}"
                low, high = 0.1 + off, 0.6 + off
                run(PLATE.format(name=name, low=low, high=high, domain=domain, **steps), 1)
                data = snapshots(name)[-1].fields
                stress = data["stress"][:, 2]
                top = data["position"][:, 2] > data["position"][:, 2].max() - 0.03
                check(f"{name}: first layer's stress, off its mean", stress[top] / stress.mean() - 1, bound)
                loads.append(History(f"{name}/tool_plate.dat")["load_z"][-1])
            check(f"{kind}, {domain}: load, sides off nodes over on nodes", loads[1] / loads[0] - 1, 1e-3)


def moments():
    """A block that a wall pushes over a rough floor in equilibrium: forces of tools act where the nodes have
    them, so that moments are in balance with its weight's."""
    run(
        "&scene title='moments', end_time=1 /\n"
        "&grid lower=0,0,0, upper=0.6,0.4,0.4, cell_size=0.05 /\n"
        "&material name='rubber', model='neo_hookean', density=1000, young=4e5, poisson=0.3 /\n"
        "&body material='rubber', shape='box', lower=0.1,0.1,0.1, upper=0.3,0.3,0.2 /\n"
        "&gravity acceleration=0,0,-9.81 /\n"
        "&tool name='floor', shape='flat', radius=10, tip=0.3,0.2,0.1, axis=0,0,1, times=0, speeds=0, "
        "penetration_factor=0.4, friction=0.3 /\n"
        "&tool name='wall', shape='flat', radius=10, tip=0.1,0.2,0.2, axis=1,0,0, times=0,0.2,0.2001, "
        "speeds=0,0,0.05, penetration_factor=0.4 /\n"
        "&quasi_static step=0.1, max_step=0.1, ramp=0.2, tolerance=1e-8 /\n"
        "&output directory='moments', every=1, history_every=1e-9 /\n",
        1,
    )
    data = snapshots("moments")[-1].fields
    middle = (data["mass"][:, None] * data["position"]).sum(axis=0) / data["mass"].sum()
    moment = np.cross(middle, [0, 0, -9.81 * data["mass"].sum()])
    for tool in ("floor", "wall"):
        rows = History(f"moments/tool_{tool}.dat")
        place, load, own = (
            np.array([rows[f"{kind}_{axis}"][-1] for axis in "xyz"])
            for kind in ("position", "load", "moment")
        )
        moment = moment - np.cross(place, load) - own
    check("moments about the origin, of weight times edge", moment / (4 * 9.81 * 0.2), 2e-4)


plates()
moments()
finish()
