"""Creep and relaxation in quasi-static steps (theory.md, eqs creep-step and creep-exponent). usage: creep.py
[sphere] (in an empty directory; GIMP3D is the program). With `sphere` the scene that ships alone."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from static_scenes import ROOT, History, check, counts, finish, require, run, tool

STRAIN = 1e-3


def held(directory, law, end, more=""):
    """A block between smooth plates, strained within a millionth of a second, then held: time since then,
    load over the first."""
    text = (
        f"&scene title='held', end_time={end} /\n"
        "&grid lower=0,0,0, upper=4,4,6, cell_size=1, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        f"&material name='soft', density=1, young=1, poisson=0.3, {law} /\n"
        "&body material='soft', shape='box', lower=0,0,0, upper=2,2,3 /\n"
        "&tool name='plate', shape='flat', radius=9, tip=0,0,3, times=0,1e-6,1.00001e-6, "
        f"speeds={3e6 * STRAIN},{3e6 * STRAIN},0 /\n"
        f"&contact compliance=1e-5 /\n&quasi_static step=1e-6 {more} /\n"
        f"&output directory='{directory}', history_every={end * 1e-9} /\n"
    )
    log = run(text, 1)
    history = tool(directory, "plate")
    after = history["time"] > 1.0001e-6
    return history["time"][after], history["load_z"][after] / history["load_z"][after][0], log


def maxwell():
    """All of the shear relaxes: the load falls as exp(-k t/tau), k by the bulk modulus that stays."""
    time, load, _ = held("maxwell", "model='maxwell', relaxation_times=1, shear_ratios=1", 5)
    mu, bulk = 1 / 2.6, 1 / 1.2
    exact = np.exp(-(time - time[0]) / (1 + mu / (3 * bulk)))
    check("maxwell: load against the exact one, over the first", load - exact, 2e-3)


def norton():
    """Against the differential equation, with two limits of creep: the smaller one is nearer."""
    worst = []
    for limit in (0.1, 0.03):
        time, load, log = held(
            f"norton_{limit}",
            f"model='norton', creep_stress={STRAIN}, creep_rate={STRAIN}, creep_exponent=5",
            1000,
            f", creep_limit={limit}",
        )
        exact = solve_ivp(
            lambda t, y: [-(y[0] ** 5)],
            (time[0], time[-1]),
            [1.0],
            method="Radau",
            rtol=1e-10,
            atol=1e-14,
            t_eval=time,
        ).y[0]
        worst.append(np.abs(load - exact).max())
        check(
            f"norton, limit {limit}: load against the differential equation, over the first",
            load - exact,
            0.01,
        )
        require("norton: not many steps", counts(log)[0] < 160)
    check("norton: error with the smaller limit over that with the larger", worst[1] / worst[0], 0.6)


def fast():
    """A block that is squeezed by 2 % while nearly all of that creeps: what is stored and dissipated is the work
    of the plate. With the work of creep by the trial stress 12 % is missing."""
    run(
        "&scene title='fast', end_time=20 /\n"
        "&grid lower=0,0,0, upper=4,4,6, cell_size=1, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        "&material name='soft', model='norton', density=1, young=1, poisson=0.3, "
        f"creep_stress={STRAIN}, creep_rate={0.1 * STRAIN}, creep_exponent=5 /\n"
        "&body material='soft', shape='box', lower=0,0,0, upper=2,2,3 /\n"
        "&tool name='plate', shape='flat', radius=9, tip=0,0,3, times=0,20, speeds=3e-3,3e-3 /\n"
        "&contact compliance=1e-5 /\n&quasi_static step=1, creep_limit=0.5 /\n"
        "&output directory='fast', history_every=1 /\n",
        1,
    )
    energy = History(Path("fast") / "energy.dat")
    work = energy["external_work"][-1]
    require("fast creep: nearly all of the work is dissipated", energy["plastic"][-1] > 0.9 * work)
    check("fast creep: energy balance", energy["balance_error"][-1], 0.01)


def sphere():
    """The scene that ships, on 2 ranks: the exponent comes back; from a checkpoint in the middle of the hold
    it ends as without."""
    text = (ROOT / "input/hold.nml").read_text().replace("'out/hold'", "'sphere'")
    log = run(text + "&checkpoint every_steps=25 /\n", 2)
    history = tool("sphere", "sphere")
    time, load = history["time"], history["load_z"]
    late = (time > 1e4) & (time <= 1000001)
    rate, mean = -np.diff(load[late]) / np.diff(time[late]), np.sqrt(load[late][1:] * load[late][:-1])
    exponent = np.polyfit(np.log(mean), np.log(rate), 1)[0]
    check(f"sphere: exponent of creep {exponent:.3f} against 5, relative", exponent / 5 - 1, 0.05)
    check("sphere: load left after the hold, of the first", load[late][-1] / load.max(), 0.15)
    require("sphere: no load once the sphere has left", load[-1] == 0.0)
    check("sphere: steps", counts(log)[0], 70)
    names = sorted(Path("sphere").glob("checkpoint_*.h5"))
    require("sphere: two checkpoints", len(names) == 2)
    names[-1].unlink()
    done = subprocess.run(
        ["mpirun", "-n", "1", os.environ["GIMP3D"], "--restart", "sphere"], capture_output=True, text=True
    )
    require(
        "sphere: it goes on", done.returncode == 0 and re.search("goes on +from", done.stdout) is not None
    )
    again = tool("sphere", "sphere")
    require("sphere: as many rows", len(again["time"]) == len(time))
    check(
        "sphere: load of the run that went on, on another number of ranks, of the largest",
        (again["load_z"] - load) / load.max(),
        1e-4,
    )


if __name__ == "__main__":
    if sys.argv[1:] == ["sphere"]:
        sphere()
    else:
        maxwell()
        norton()
        fast()
    finish()
