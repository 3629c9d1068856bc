"""How far the load of a cone falls when the cone stops, in soft metal that does not harden (E/Y = 700;
doc/notebook/load_at_a_stop.md). A quarter of a block of 1.3 x 1.3 x 0.9 um, all of it plastic at the end: its
load is that of no half-space, but it falls as that does. One run goes on at full speed beyond the depth that
is asked about; the others slow down over a quarter of their time, come to rest at that depth, and stand.

usage: stopping_tool.py PROGRAM [--cell 100] [--kind volumetric none] [--domain stretch] [--flip 1]
[--speeds 1 0.5 0.25] (numpy; in an empty directory; half a minute a run at full speed on a core that is
free, a quarter of that with --cell 150). Kinetic energy and what is lost are those at the end of the run, of
the work; `apart` is by how much the tool's work differs between the motion of nodes and of particles."""

import argparse
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from gimp3d.benchmark_scenes import Motion, power_law, words
from gimp3d.run_data import History

YIELD = 100e6  # Pa
WIDE, HIGH = 1300e-9, 900e-9  # m
DEPTH, BEYOND = 150e-9, 165e-9  # m
SPEED = 13.74  # m/s, that of the benchmark


def scene(directory, kind, o, times, speeds, end):
    cell = o.cell * 1e-9
    wide, high = cell * math.ceil(WIDE / cell - 1e-6), cell * round(HIGH / cell)
    return f"""&scene title='cone that stops', end_time={end:.10g} /
&grid lower=0,0,0, upper={words((wide + 2 * cell, wide + 2 * cell, high + 3 * cell))}, cell_size={cell:.10g},
      boundary='symmetry','free','symmetry','free','fixed','free' /
{power_law(YIELD, 0)}
&body material='metal', shape='box', lower=0,0,0, upper={words((wide, wide, high))}, particles_per_cell=8 /
&tool name='tool', shape='cone', half_angle=70.3, tip=0,0,{high:.10g}, times={words(times)},
      speeds={words(speeds)} /
&time domain='{o.domain}', flip_fraction={o.flip:.10g} /
&anti_locking kind='{kind}' /
&output directory='{directory}', formats='none', history_every={end / 700:.10g} /
"""


def going_on(directory, kind, o):
    ramp = 0.05 * BEYOND / SPEED
    return scene(directory, kind, o, (0, ramp), (0, SPEED), BEYOND / SPEED + 0.5 * ramp)


def stopping(directory, kind, o, share):
    motion = Motion(DEPTH, DEPTH / (0.85 * SPEED * share), back=1e-9, hold=0.4)
    times, speeds, _ = motion.values()
    return scene(directory, kind, o, times[:5], speeds[:5], times[4])


def run(program, name, text):
    done = subprocess.run(["mpirun", "-n", "1", program], input=text, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{name}: exit status {done.returncode}\n{done.stdout[-1000:]}{done.stderr[-1000:]}")
    apart = re.search(r"differs by at most .*?, (\S+) %", done.stdout)
    tool, energy = History(Path(name) / "tool_tool.dat"), History(Path(name) / "energy.dat")
    return tool, energy, float(apart[1]) if apart else np.nan


def figures(tool, energy):
    """Load over Y h^2, and what the energies are over the work, at the end of the run."""
    load = 4 * tool["load_z"] / (YIELD * tool["depth"].clip(1e-9) ** 2)
    last = {name: energy[name][-1] / energy["external_work"][-1] for name in ("kinetic", "strain", "plastic")}
    return load, last, 1 - sum(last.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--cell", type=float, default=100, help="nm")
    parser.add_argument("--flip", type=float, default=1)
    parser.add_argument("--kind", nargs="+", default=["volumetric", "none"])
    parser.add_argument("--domain", default="stretch")
    parser.add_argument("--speeds", nargs="+", type=float, default=[1, 0.5, 0.25])
    options = parser.parse_args()
    print("anti-locking  speed  load/(Y h^2)  of that in motion [%]  kinetic, lost / work [%]  apart [%]")
    for kind in options.kind:
        tool, energy, apart = run(options.program, kind, going_on(kind, kind, options))
        load, last, lost = figures(tool, energy)
        near = abs(tool["depth"] - DEPTH) < 0.04 * DEPTH
        moving = load[near].mean()
        kinetic = 100 * last["kinetic"]
        print(
            f"{kind:12}      -  {moving:.1f} in motion  {kinetic:.2f}  {100 * lost:.2f}  {apart}", flush=True
        )
        for share in options.speeds:
            name = f"{kind}_{share:g}"
            tool, energy, apart = run(options.program, name, stopping(name, kind, options, share))
            load, last, lost = figures(tool, energy)
            stands = np.flatnonzero(tool["depth"] > (1 - 1e-6) * tool["depth"].max())
            first, end = load[stands[: len(stands) // 20]].mean(), load[stands[-len(stands) // 10 :]].mean()
            print(
                f"{kind:12}  {share:5g}  {first:.1f} to {end:.1f}  {100 * first / moving - 100:+.1f} to "
                f"{100 * end / moving - 100:+.1f}  {100 * last['kinetic']:.2f}  {100 * lost:.2f}  {apart}",
                flush=True,
            )


main()
