"""Implicit steps with a tool whose ridge stands over particle centres: nothing sideways, and the work of the
tool is what the body's energy grows by (theory.md, Quasi-static steps, Contact). usage: ridge.py (in an empty
directory; GIMP3D is the program)"""

from pathlib import Path

import numpy as np

from static_scenes import History, check, counts, finish, require, run, tool


def scene(name, cell_count, steps, tip="4.5,2,5", shape="shape='wedge', half_angle=45, edge=0,1,0", more=""):
    return (
        f"&scene title='{name}', end_time=1 /\n"
        "&grid lower=0,0,0, upper=9,4,8, cell_size=1, "
        "boundary='free','symmetry','free','symmetry','fixed','free' /\n&time domain='stretch' /\n"
        "&material name='m', model='elastic', density=1, young=1000, poisson=0.3 /\n"
        f"&body name='b', material='m', shape='box', particles_per_cell={cell_count}, lower=3,0,0, "
        "upper=6,4,5 /\n"
        f"&tool name='t', {shape}, tip={tip}, axis=0,0,-1, times=0, speeds=0.3{more} /\n"
        f"{steps}&output directory='{name}', history_every=0 /\n"
    )


def balance(name):
    """Energy over work at the end."""
    energy = History(Path(name) / "energy.dat")
    return (energy["strain"][-1] + energy["kinetic"][-1]) / energy["external_work"][-1]


def works(name):
    """Work of the tool less that of the particles that it presses, of all of it: gaps that are not carried on
    push the body, by a third of the work."""
    energy = History(Path(name) / "energy.dat")
    return np.abs(energy["external_work"] - energy["particle_work"]).max() / energy["external_work"][-1]


def ridges():
    """Over a column of centres the face of the nearest one is the one or the other inside the wedge. Seen from
    outside it is one smooth surface."""
    run(scene("explicit", 1, ""), 1)
    explicit = tool("explicit", "t")["load_z"][-1]
    for number, (cell_count, steps) in enumerate(
        (
            (1, "step=0.02, max_step=0.02"),
            (1, "step=0.1, max_step=0.1"),
            (1, "step=1, max_step=1"),
            (1, "mode='newmark', step=0.02"),
            (1, "mode='newmark', step=0.1"),
            (8, "step=0.1, max_step=0.1"),
            (8, "mode='newmark', step=0.1"),
        )
    ):
        name = f"ridge_{number}"
        log = run(scene(name, cell_count, f"&quasi_static {steps} /\n"), 1)
        what = f"{cell_count} a cell, {steps}"
        history = tool(name, "t")
        load = history["load_z"][-1]
        check(f"{what}: load sideways, of the largest", np.abs(history["load_x"]).max() / load, 1e-5)
        check(f"{what}: energy over work less 1", balance(name) - 1, 0.05)
        if cell_count == 1 and "=0.02" in steps:
            check(f"{what}: load against explicit steps, relative", load / explicit - 1, 0.05)
        check(f"{what}: work of the tool and of the particles apart", works(name), 0.03)
        require(f"{what}: no word of energy", "WARNING: energy" not in log)
        kind = "newmark" if "newmark" in steps else "quasi-static"
        require(f"{what}: no step halved", counts(log, kind)[4] == 0)


def apex():
    """The same of a pyramid over one column."""
    pyramid = "shape='pyramid', faces=4, half_angle=60, edge=1,1,0"
    log = run(scene("apex", 1, "&quasi_static step=0.2, max_step=0.2 /\n", "4.5,1.5,5", pyramid), 1)
    history = tool("apex", "t")
    side = np.abs(history["load_x"]).max()  # along y the symmetry planes are not as far away
    check("pyramid: load sideways, of the largest", side / history["load_z"][-1], 1e-6)
    check("pyramid: energy over work less 1", balance("apex") - 1, 0.05)
    check("pyramid: Newton iterations a step", counts(log)[1], 5)  # 14 without the turning of the normal


if __name__ == "__main__":
    ridges()
    apex()
    finish()
