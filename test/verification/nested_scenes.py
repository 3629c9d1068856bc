"""Scenes on nested levels beside the same on one level: load, stress, time and memory as ratios measured in
one run.

usage: nested_scenes.py CASE [CASE ...]
sphere    E3 (input/sphere_levels.nml) beside one level of 1.28 and of 0.64 um, and with all levels on the
finest time step
cone      E4's cone on the quarter block, three levels of 64, 32, 16 nm, beside one level of 16 and of 64 nm,
to 40 nm
patch     E5 (input/bilinear_levels.nml) beside one level of 0.5 and of 0.25 mm
moving    a sphere into a block, a level that stays, follows the tool or is placed by the stress, beside one
level"""

import re
import sys
from pathlib import Path

import numpy as np

from run_scene import ROOT, probe, replace, run, seconds_and_particles
from checks import check, finish, require
from runs import History, Particles

MOVING = """&scene title='sphere on a level that moves', end_time=2.2e-8 /
&grid lower=0,0,0, upper=61.44e-6,61.44e-6,38.4e-6, cell_size=2.56e-6, boundary='symmetry','free','symmetry','free','roller','free' /
&level lower=0,0,20.48e-6, upper=12.8e-6,12.8e-6,38.4e-6 /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='box', lower=0,0,0, upper=56.32e-6,56.32e-6,30.72e-6, particles_per_cell=1 /
&tool name='sphere', shape='sphere', radius=6.4e-6, tip=0,0,30.72e-6, axis=0,0,-1, times=0,2.9e-9, speeds=0,150.8,
      penetration_factor=0.4 /
&output directory='out', every=4e-9 /
"""


class Outcome:
    """What one run of a scene gave."""

    def __init__(self, name, text, ranks=2, tool=None):
        text = re.sub(
            r"&output.*/", f"&output directory='{name}', formats='hdf5', every={self.every(text)} /", text
        )
        self.name, self.log = name, run(text, ranks)
        self.seconds, self.particles = seconds_and_particles(self.log)
        figures = self.log.figures
        self.work, self.steps = figures["particle_steps"], int(figures["steps"])
        self.megabytes = 1e-6 * figures["memory_at_start_B"]
        self.tool = History(Path(name) / f"tool_{tool}.dat") if tool else None
        self.peaks = [peak(path) for path in sorted(Path(name).glob("particles_*.hdf"))]

    @staticmethod
    def every(text):
        return float(re.search(r"end_time=([-+0-9.eE]+)", text)[1]) / 4

    def load(self, depth):
        return np.interp(depth, self.tool["depth"], self.tool["load_z"])

    def noise(self, depth):
        """Rms of the load about a parabola over 5 % of the depth on either side, relative, over the second
        half."""
        own, load = self.tool["depth"], self.tool["load_z"]
        off = []
        for here in depth[depth > 0.5 * depth[-1]]:
            near = abs(own - here) <= 0.05 * depth[-1]
            off.append(
                np.interp(here, own, load) / np.polyval(np.polyfit(own[near] - here, load[near], 2), 0.0) - 1
            )
        return np.sqrt(np.mean(np.square(off)))


def peak(path):
    """Largest von Mises stress of the particles of a snapshot, Pa."""
    s = Particles(path)["stress"].T
    return np.sqrt(
        0.5 * ((s[0] - s[1]) ** 2 + (s[1] - s[2]) ** 2 + (s[2] - s[0]) ** 2)
        + 3 * (s[3] ** 2 + s[4] ** 2 + s[5] ** 2)
    ).max()


def compare(runs, reference, depths):
    """A table of the runs; the mean difference of the load to that of the reference over the second half of
    the depth, and that of the peak stress in the last two snapshots."""
    late = depths[depths > 0.5 * depths[-1]]
    print(
        f"   {'':24} {'particles':>9} {'MB':>7} {'steps':>6} {'s':>7} {'time':>6} {'memory':>6} {'load':>7} "
        f"{'peak stress':>11} {'noise':>7}"
    )
    found = {}
    for one in runs:
        load = np.mean(np.abs(one.load(late) / reference.load(late) - 1))
        stress = max(abs(a / b - 1) for a, b in zip(one.peaks[-2:], reference.peaks[-2:]))
        found[one.name] = load, stress, one.noise(depths)
        print(
            f"   {one.name:24} {one.particles:9d} {one.megabytes:7.1f} {one.steps:6d} {one.seconds:7.2f} "
            f"{one.seconds / reference.seconds:6.3f}"
            f" {one.megabytes / reference.megabytes:6.3f} {100 * load:6.2f} % {100 * stress:9.2f} % "
            f"{100 * found[one.name][2]:5.2f} %"
        )
    return found


def without_levels(text, cell=None):
    text = re.sub("^&level.*\n", "", text, flags=re.M)
    return re.sub(r"cell_size=\S+?(?=[,\s])", f"cell_size={cell}", text) if cell else text


def lockstep(text):
    if "&time" in text:
        return re.sub("&time ", "&time subcycle=.false., ", text)
    return text.replace("&material", "&time subcycle=.false. /\n&material", 1)


def with_particles(text, per_cell):
    return re.sub("particles_per_cell=1 ", f"particles_per_cell={per_cell} ", text)


def sphere():
    text = (ROOT / "input/sphere_levels.nml").read_text()
    half = lambda text: re.sub(r"time_step=\S+", "time_step=1.03453e-11", text)
    runs = [
        Outcome("coarse", without_levels(text), tool="sphere"),
        Outcome("two levels", text, tool="sphere"),
        Outcome("two levels, one step", half(lockstep(text)), tool="sphere"),
        Outcome("fine", half(without_levels(text, "0.64e-6")), tool="sphere"),
    ]
    depths = np.linspace(0.1e-6, 3.4e-6, 200)
    found = compare(runs, runs[-1], depths)
    check("E3: peak stress of two levels off the uniform fine grid", found["two levels"][1], 0.02)
    check("E3: load of two levels off the uniform fine grid", found["two levels"][0], 0.02)
    late = depths[depths > 0.5 * depths[-1]]
    check(
        "E3: load, subcycled against one time step",
        np.mean(np.abs(runs[1].load(late) / runs[2].load(late) - 1)),
        0.01,
    )
    print(f"   time, subcycled over one time step: {runs[1].seconds / runs[2].seconds:.2f}")
    require("E3: two levels have fewer particle-steps than the fine grid", runs[1].work < runs[-1].work)


def cone():
    text = (ROOT / "input/cone_levels.nml").read_text()
    text = replace(text, "lower=-3008e-9,-3008e-9,0", "lower=0,0,0")
    text = replace(
        text,
        "'free','free','free','free','roller','free'",
        "'symmetry','free','symmetry','free','roller','free'",
    )
    text = re.sub("lower=-[0-9]+e-9,-[0-9]+e-9", "lower=0,0", text)
    text = re.sub(r"end_time=\S+", "end_time=4.1e-10", text)
    runs = [
        Outcome("64 nm", without_levels(text), tool="cone"),
        Outcome("64, 32, 16 nm", text, tool="cone"),
        Outcome("16 nm", without_levels(text, "16e-9"), tool="cone"),
    ]
    found = compare(runs, runs[-1], np.linspace(5e-9, 39e-9, 100))
    check("E4: load of three levels off the uniform fine grid", found["64, 32, 16 nm"][0], 0.03)
    require("E4: the load is smoother than on the coarse grid", found["64, 32, 16 nm"][2] < found["64 nm"][2])


def moving():
    runs = [
        Outcome("coarse", without_levels(MOVING), 1, "sphere"),
        Outcome("stays", MOVING, 1, "sphere"),
        Outcome(
            "follows", MOVING.replace("38.4e-6 /\n&mat", "38.4e-6, follow='sphere' /\n&mat"), 1, "sphere"
        ),
        Outcome(
            "by stress",
            MOVING.replace("38.4e-6 /\n&mat", "38.4e-6, criterion='stress', max_cells=4000 /\n&mat"),
            1,
            "sphere",
        ),
        Outcome("one step", lockstep(MOVING), 1, "sphere"),
        Outcome("fine", without_levels(MOVING, "1.28e-6"), 1, "sphere"),
    ]
    found = compare(runs, runs[-1], np.linspace(0.2e-6, 3e-6, 100))
    for name in "stays", "follows", "by stress", "one step":
        check(f"sphere, level {name}: load off the uniform fine grid", found[name][0], 0.01)
        require(
            f"sphere, level {name}: nearer to the fine grid than the coarse one",
            found[name][0] < 0.5 * found["coarse"][0],
        )
    require(
        "a level has less than half the particle-steps of a fine grid", runs[1].work < 0.5 * runs[-1].work
    )


def patch():
    text = (ROOT / "input/bilinear_levels.nml").read_text()
    runs = [
        Outcome("0.5 mm", without_levels(text)),
        Outcome("two levels", text),
        Outcome("0.25 mm", without_levels(text, "0.25e-3")),
    ]
    shown = ("von_mises", "stress_zz", "stress_xx", "equivalent_plastic_strain")
    print(
        f"   {'':12} {'particles':>9} {'s':>7} {'time':>6} {'memory':>6}   largest differences at 100, 200, "
        "300, 400 MPa: " + ", ".join(shown)
    )
    fine = runs[-1]
    for one in runs:
        off = [0.0] * len(shown)
        for letter in "abcdefgh":
            own, other = probe(one.name, letter), probe(fine.name, letter)
            times = np.array((5e-6, 10e-6, 15e-6, 20e-6))
            for i, column in enumerate(shown):
                a, b = (np.interp(times, h["time"], h[column]) for h in (own, other))
                off[i] = max(off[i], np.max(np.abs(a - b)) / np.max(np.abs(b)))
        one.off = off
        print(
            f"   {one.name:12} {one.particles:9d} {one.seconds:7.2f} {one.seconds / fine.seconds:6.3f} "
            f"{one.megabytes / fine.megabytes:6.3f}   " + ", ".join(f"{100 * x:.2f} %" for x in off)
        )
    for i, column in enumerate(shown):
        check(f"E5: {column} of two levels off the uniform fine grid", runs[1].off[i], 0.02)
    require("E5: two levels have fewer particle-steps than the fine grid", runs[1].work < fine.work)


for case in sys.argv[1:]:
    print(f"   {case}")
    {"sphere": sphere, "cone": cone, "moving": moving, "patch": patch}[case]()
finish()
