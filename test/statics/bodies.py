"""Quasi-static steps with bodies of several contact groups, against exact answers (theory.md, eq.
static-pairs). usage: bodies.py [long] (in an empty directory; GIMP3D is the program)"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from static_scenes import ROOT, History, check, finish, last_particles, newton_by_step, require, run


def stack(name, more=""):
    """Two blocks under a plate, with the interface between two planes of nodes."""
    return (
        f"&scene title='{name}', end_time=1 /\n"
        "&grid lower=0,0,0, upper=8,8,10, cell_size=1, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        "&time domain='stretch' /\n"
        "&material name='m', model='elastic', density=1, young=1e3, poisson=0.3 /\n"
        "&body material='m', shape='box', lower=0,0,0, upper=6,6,4.5, contact_group='low' /\n"
        "&body material='m', shape='box', lower=0,0,4.5, upper=6,6,8.5, contact_group='high' /\n"
        "&tool name='plate', shape='flat', radius=15, tip=0,0,8.5, times=0, speeds=0.4 /\n"
        "&quasi_static step=0.125, max_step=0.125, iterations=.true. /\n"
        f"&output directory='{name}', history_every=1e-9 /\n" + more
    )


def pair(name, one="low", other="high"):
    return History(Path(f"{name}/contact_{one}_{other}.dat"))


def pressed_blocks(numbers=(1, 2)):
    """Stress is the same everywhere; what one block feels the other does, and so does the plate; on any
    number of ranks."""
    loads = {}
    for ranks in numbers:
        name = f"stack_{ranks}"
        newton = newton_by_step(run(stack(name), ranks))
        require(f"{name}: Newton iterations a step: {newton}", max(newton) <= 7)
        loads[ranks] = pair(name)["force_z"][1:]
        plate = History(Path(f"{name}/tool_plate.dat"))["load_z"][1:]
        check(f"{name}: force on the lower block against the plate's load", loads[ranks] / -plate - 1, 1e-5)
        if ranks > 1:
            check(f"{name}: against 1 rank", loads[ranks] / loads[1] - 1, 1e-5)
    stress = last_particles("stack_1")["stress"]
    check("stack: szz off its mean, of that", stress[:, 2] / stress[:, 2].mean() - 1, 0.01)
    check("stack: other components, of szz", stress[:, [0, 1, 3, 4, 5]] / stress[:, 2].mean(), 0.02)


def sliding():
    """A block pushed over another meets friction times its weight and makes heat of it; on a slope that is
    less than the friction it stays."""
    scene = (
        "&scene title='{name}', end_time=1 /\n"
        "&grid lower=0,0,0, upper=12,6,8, cell_size=1, "
        "boundary='roller','roller','symmetry','roller','fixed','free' /\n"
        "&material name='m', model='elastic', density=1, young=1e3, poisson=0.3 /\n"
        "&body material='m', shape='box', lower=0,0,0, upper=12,6,3, contact_group='low' /\n"
        "&body material='m', shape='box', lower=3,0,3, upper=7,3,5, contact_group='high' /\n"
        "&body_contact friction=0.3 /\n{more}"
        "&output directory='{name}', history_every=1e-9 /\n"
    )
    weight = 24 * 0.1
    name = "pushed"
    run(
        scene.format(
            name=name,
            more="&gravity acceleration=0,0,-0.1 /\n"
            "&tool name='push', shape='flat', radius=5, axis=1,0,0, tip=3,1.5,8.6, times=0,0.2,1, "
            "speeds=0,1,1 /\n&quasi_static step=0.1, ramp=0.2 /\n",
        ),
        1,
    )
    history, push = pair(name), History(Path(f"{name}/tool_push.dat"))
    slid = history["time"] > 0.45
    borne = history["force_z"] + push["load_z"]  # the rim of the tool's face bears some of it
    check("pushed: weight on the lower block and the tool, off 1", borne[slid] / -weight - 1, 1e-5)
    check(
        "pushed: friction over friction times weight, off 1",
        history["force_x"][slid] / (0.3 * weight) - 1,
        1e-3,
    )
    check(
        "pushed: what the tool bears of it, off 1", push["load_x"][slid] / -history["force_x"][slid] - 1, 1e-3
    )
    made = np.diff(history["friction_heat"][slid]) / (0.3 * weight * np.diff(push["depth"][slid]))
    check("pushed: heat over friction times way, off 1", made - 1, 1e-3)
    for ranks in (1, 2):
        name = f"slope_{ranks}"
        run(
            scene.format(
                name=name,
                more="&gravity acceleration=0.02,0,-0.1 /\n"
                "&quasi_static step=0.25, ramp=1, tolerance=1e-7 /\n",
            ),
            ranks,
        )
        history = pair(name)
        check(
            f"{name}: friction holds the block, off its part of the weight",
            history["force_x"][-1] / 0.48 - 1,
            1e-5,
        )


def hertz():
    """A cylinder on a plate under its own weight, as the explicit scheme brings it to rest."""
    from hertz import cylinder

    share, width, off, rough = cylinder("hertz", half=1.5, radius=12.0, steps=4, static=True, tolerance=1e-7)
    check("hertz: load over the weight, off 1", share - 1, 1e-5)
    check("hertz: half-width over Hertz's, off 1", width - 1, 0.1)  # three particles
    check("hertz: single pressures about Hertz's, of their mean", rough, 0.15)
    check("hertz: stress of layers 2 to 4 off Hertz's, in p0", np.array(off[1:]), 0.05)


def small_load():
    """A load that begins small: guesses in which nothing presses stand between those that do."""
    text = (ROOT / "input/static_roller.nml").read_text()
    run(text.replace("end_time=1 ", "end_time=1e-5 ").replace("out/static_roller", "small"), 1)
    check(
        "small load: force on the plate, off 1",
        pair("small", "plate", "roller")["force_z"][-1] / -1.214e-3 - 1,
        1e-5,
    )


UNLIKE = """&scene title='{name}', end_time=1 /
&grid geometry='plane_strain', lower=0,0, upper=3,3, cell_size=0.25, boundary='symmetry','free','roller','free' /
&material name='upper', {upper}, density=1000, young=1e9, poisson=0.3 /
&material name='lower', {lower}, density=1000, young=1e9, poisson=0.3 /
&body material='lower', shape='box', lower=0,0,0, upper=2,1,1, contact_group='low', particles_per_cell={count} /
&body material='upper', shape='box', lower=0,0,1, upper=1,1,2, contact_group='high' /
&pressure lower=0,0,2, upper=1,1,2, times=0,1, values=0,1e6 /
&quasi_static step=0.25, iterations=.true. /
&output directory='{name}', history_every=1e-9 /
"""


def unlike():
    """A narrow block on a wide one of a law that may flow, or of fewer particles, which have no compliance below
    a cell: as many Newton iterations as with bodies of one kind, and the same force, that of the pressure."""
    elastic, metal = "model='elastic'", "model='j2', yield_stress=1e8"
    for name, upper, lower, count in (
        ("alike", elastic, elastic, 8),
        ("below_metal", elastic, metal, 8),
        ("above_metal", metal, elastic, 8),
        ("below_coarse", elastic, elastic, 1),
    ):
        newton = newton_by_step(run(UNLIKE.format(name=name, upper=upper, lower=lower, count=count), 1))
        require(f"{name}: Newton iterations a step: {newton}", max(newton) <= 10)
        # the pressed face becomes wider by a thousandth of the pressure over the modulus
        check(f"{name}: force over that of the pressure, less 1", pair(name)["force_z"][-1] / -1e6 - 1, 1e-3)


MIXED = """&scene title='mixed', end_time=1 /
&grid geometry='plane_strain', lower=-3,0, upper=3,3.5, cell_size=0.25, boundary='roller','roller','roller','free' /
&material name='a', model='elastic', density=1000, young=1e9, poisson=0.3 /
&material name='b', model='j2', density=1000, young=1e9, poisson=0.3, yield_stress=1e9 /
&body material='b', shape='box', lower=-3,0,0, upper=0,1,2 /
&body material='a', shape='box', lower=0,0,0, upper=3,1,2 /
&tool name='t', shape='cylinder', edge=0,1,0, radius=6, tip=0,0,2, times=0,1, loads=0,2e7, mass=1, friction=0.3 /
&quasi_static step=0.25, max_step=0.25, iterations=.true. /
&output directory='mixed', history_every=1e-9 /
"""


TOPS = """&scene title='steel on plastic', end_time=1 /
&grid geometry='axisymmetric', lower=0,0, upper=14e-3,24e-3, cell_size=1e-3,
      boundary='symmetry','free','roller','free' /
&material name='plastic', model='elastic', density=1000, young=1e9, poisson=0.3 /
&material name='steel', model='elastic', density=7800, young=200e9, poisson=0.3 /
&body material='plastic', shape='cylinder', center=0,0,0, radius=10e-3, height={interface},
      contact_group='low' /
&body material='steel', shape='cylinder', center=0,0,{interface}, radius=10e-3, height={height},
      contact_group='high' /
&tool name='plate', shape='flat', radius=0.05, tip=0,0,{top}, times=0, speeds=5e-6 /
&quasi_static step=1, max_step=1 /
&output directory='{name}', formats='none' /
"""


def tops():
    """A stiff block that contact alone holds passes a plane of nodes by round-off or little more: nodes that
    it hardly reaches must not hold it. The plate bore 5 to 32 times the load where their weights vanished."""
    for interface, beyond in ((10.3e-3, 0.0), (10.3e-3, 1e-15), (10.3e-3, 1e-8), (10.6e-3, 0.0)):
        name, top = f"top_{interface}_{beyond}", 20e-3 + beyond
        height = top - interface
        run(TOPS.format(name=name, interface=interface, height=height, top=top), 1)
        plate = History(Path(name) / "tool_plate.dat")["load_z"][-1]
        force = -pair(name, "low", "high")["force_z"][-1]
        bar = np.pi * 10e-3**2 * 5e-6 / (interface / 1e9 + height / 200e9)
        check(f"{name}: load of the plate over that of bars in a row, less 1", plate / bar - 1, 0.01)
        check(f"{name}: force between the blocks, the same", force / bar - 1, 0.01)


def mixed():
    """A tool on a body of two laws, one with the compliance below a cell: 19 iterations a step, were its own
    part that of a point's particle alone."""
    newton = newton_by_step(run(MIXED, 1))
    require(f"mixed: Newton iterations a step: {newton}", max(newton) <= 8)


FIT = """&scene title='fit', end_time=1 /
&grid geometry='axisymmetric', lower=0,0, upper=110e-3,10e-3, cell_size=2.5e-3,
      boundary='symmetry','free','symmetry','symmetry' /
&time domain='corners' /
&material name='steel', model='elastic', density=7800, young=210e9, poisson=0.3 /
&material name='aluminium', model='elastic', density=2700, young=70e9, poisson=0.33 /
&body name='shaft', material='steel', shape='cylinder', center=0,0,0, radius=50.025e-3, height=10e-3, contact_group='low' /
&body name='hub', material='aluminium', shape='cylinder', center=0,0,0, radius=100e-3, height=10e-3, contact_group='high' /
&cut body='hub', shape='cylinder', center=0,0,-5e-3, radius=49.975e-3, height=20e-3 /
&body_contact groups='low','high', start='as_is', press_fit={fit} /
&quasi_static step=0.25, max_step=0.25 /
&output directory='fit', formats='none' /
"""


def fit():
    """What a press fit takes is what its bodies store, in few steps, and wherever the fit ends in a step."""
    for time in (0.5, 0.6):
        run(FIT.format(fit=time), 1)
        rows = History(Path("fit/energy.dat"))
        require(f"press fit over {time} s: energy is stored", rows["strain"][-1] > 2.5)
        check(
            f"press fit over {time} s: work over stored energy, less 1",
            rows["external_work"][-1] / rows["strain"][-1] - 1,
            1e-3,
        )


def changes():
    """Loaded by explicit steps, held by quasi-static ones, and let go by explicit ones: the force goes on."""
    name = "changes"
    text = stack(name).replace("end_time=1", "end_time=1.2")
    text = text.replace("times=0, speeds=0.4", "times=0,1,1.0001, speeds=0.4,0.4,0").replace(
        "max_step=0.125", "max_step=0.125, to=1.01"
    )
    run(text, 1)
    history = pair(name)
    time, force = history["time"], history["force_z"]
    held = force[(time > 0.99) & (time <= 1.01)][-1]
    after = force[time > 1.04]  # the first steps ring
    print(f"   changes: force held {held:.3f} N, afterwards {after.min():.3f} to {after.max():.3f} N")
    check("changes: force in explicit steps afterwards, off that held", after / held - 1, 0.01)


def levels_and_restart():
    """On a level that holds both blocks' surfaces the force is that of one grid, and a run that is taken up
    again on 2 ranks goes on as if it had not been stopped."""
    name = "levels"
    run(stack(name, "&level lower=0,0,3, upper=8,8,10 /\n&checkpoint every_steps=3 /\n"), 1)
    force = pair(name)["force_z"]
    check("levels: force against that without, off 1", force[-1] / pair("stack_1")["force_z"][-1] - 1, 5e-3)
    max(Path(name).glob("checkpoint_*.h5")).unlink()
    done = subprocess.run(
        ["mpirun", "-n", "2", os.environ["GIMP3D"], "--restart", name], check=False, capture_output=True
    )
    require("restart on 2 ranks: status", done.returncode == 0)
    check("restart on 2 ranks: force, of the largest", (pair(name)["force_z"] - force) / force.min(), 1e-5)


def long():
    """On 4 ranks; on a level, and taken up again; a cylinder; from and to explicit steps. The cylinder finer,
    at several heights of the interface in its cell and with all shapes of domains."""
    from hertz import judged

    pressed_blocks((1, 4))
    levels_and_restart()
    hertz()
    changes()
    for domain, offset in (
        ("fixed", 0.0),
        ("fixed", 0.2),
        ("fixed", 0.6),
        ("stretch", 0.41),
        ("corners", 0.87),
    ):
        judged(f"static_{domain}_{offset}", domain=domain, offset=offset, steps=5, static=True)


if sys.argv[1:] == ["long"]:
    long()
else:
    pressed_blocks()
    sliding()
    small_load()
    tops()
    unlike()
    mixed()
    fit()
finish()
