#!/usr/bin/env python3
"""A stand-in for `mpirun -n RANKS gimp3d`: answers a scene at once, with an error and a price that are known.

The load is K depth^1.5 (1 + A h^ORDER + B speed body + Q speed^2 + C safety + D/body): h the finest cell in um, speed
that of the tool over 20 m/s, safety over 0.35, body the size of the cylinder over 20 um. A run takes steps and particle-steps as the scene's cells say, and RATE s for
each, much more with levels. Variables of the environment: PRETEND_A, PRETEND_ORDER, PRETEND_B, PRETEND_Q, PRETEND_C, PRETEND_D;
PRETEND_FILL is added in proportion to h where the body is filled by shares. PRETEND_JUMP adds an error to cells below a size (um) that no coarser one has; PRETEND_REFUSED is a list of
cells (um) that are refused; PRETEND_LOG a file that gets a line a run. PRETEND_SHARE (%): other jobs have the
processor for the rest, by turns more and less, and all takes as much longer. PRETEND_PLAN: a plan says so
many times what it will be."""

import os
import sys
from pathlib import Path

import numpy as np

from gimp3d.run_data import read_namelists

RATE = 2e-7  # s
number = lambda name, default: float(os.environ.get(f"PRETEND_{name}", default))
text = sys.stdin.read()
case = read_namelists(text)
scene, grid, tool = case["scene"][0], case["grid"][0], case["tool"][0]
time_group = case.get("time", [{}])[0]
cell, levels = grid["cell_size"][0] * 1e6, len(case.get("level", []))
finest, speed, safety = cell / 2**levels, max(tool["speeds"]) / 20, time_group.get("safety", [0.35])[0] / 0.35
plans = scene.get("mode", ["run"])[0] == "plan"
with open(os.environ["PRETEND_LOG"], "a") as log:
    print("plan" if plans else "run", f"{finest:.4g} {levels} {speed:.4g} {safety:.4g}", file=log)
if any(abs(cell - float(word)) < 1e-6 * cell for word in os.environ.get("PRETEND_REFUSED", "").split()):
    print(f"gimp3d: line 2, &grid cell_size={cell}e-6: does not divide the body", file=sys.stderr)
    sys.exit(2)
body = (case["body"][0]["radius"][0] ** 2 * case["body"][0]["height"][0]) ** (1 / 3) / 20e-6
steps = 500 / (cell * speed * safety)
particles = 50000 / cell**3 * (body**3 + 0.5 * levels)
updates = steps * particles * (1 + levels)
seconds = RATE * updates * (1 + 1.5 * levels) + 1e-4 * steps
megabytes = 3e-4 * particles
with open(os.environ["PRETEND_LOG"]) as log:
    turn = len(log.readlines()) % 3
share = number("SHARE", 100) * (1, 0.5, 0.8)[turn] if "PRETEND_SHARE" in os.environ else 100.0
seconds *= 100 / share
if plans:
    seconds *= number("PLAN", 1)
    print(
        f"steps      {steps:.0f} of the coarsest level\nmemory     {megabytes:.4g} MB on all ranks together: "
        "particles 1 MB"
    )
    print(f"plan       by 4 steps timed on 1 rank(s) in 1 s, processors at {share:.6g} %")
    print(f"time       1 s ({seconds + 0.5:.9g} s), of that 0.5 s until the first step")
    print("output     0 snapshots of 0 B, 10 rows of histories, 0.5 s without the disk's own time")
    print("output      0.5 0.5 0.5 0 1 1.0 %\nall         9 9 9 0 1 100.0 %")
    print(f"{updates:.0f} particle-steps on 1 ranks in {seconds:.3g} s")
    if levels:  # by level: s, ns/part.-step
        print("output      0.000 0.00 0.000 0.00\nall         0.159 423.69 0.657 1367.21")
    sys.exit()
error = (
    number("A", 0.02) * finest ** number("ORDER", 1.5)
    + number("B", 0) * speed * body
    + number("C", 0) * safety
)
error += number("Q", 0) * speed**2 + number("D", 0) / body
if case["body"][0].get("fill", ["whole"])[0] == "share":
    error += number("FILL", 0) * finest
if finest < number("JUMP", 0):
    error += 0.05
time = np.linspace(0, scene["end_time"][0], 201)
depth = np.interp(time, tool["times"], np.array([0, 0.5e-6]))
depth = 0.5e-6 * time / time[-1]
load = 1e9 * depth**1.5 * (1 + error)
Path("tool_sphere.dat").write_text(
    'TITLE = "pretended"\nVARIABLES = "time [s]" "depth [m]" "load_x [N]" "load_y [N]" "load_z [N]"\n'
    'ZONE T="history", STRANDID=1, SOLUTIONTIME=0\nAUXDATA model_share="0.25"\n'
    + "".join(f"{t:.10e} {d:.10e} 0 0 {f:.10e}\n" for t, d, f in zip(time, depth, load))
)
Path("cost.dat").write_text(f'AUXDATA phase_1="all"\n1 {seconds:.9g} {seconds:.9g} {seconds:.9g}\n')
print(f"particles  {particles:.0f} on 1 rank(s), {megabytes:.6g} MB in all, 272 B a particle")
print(f"{steps:.0f} steps to the end\n{updates:.0f} particle-steps on 1 ranks in {seconds:.3g} s")
print(f"processors: 1 s of work, {share:.6g} % of the elapsed time")
