#!/usr/bin/env python3
"""A stand-in for `mpirun -n RANKS gimp3d`: answers a scene at once, with an error and a price that are known.

The load is K depth^1.5 (1 + A h^ORDER + B speed body + Q speed^2 + C safety + D/body): h the finest cell in um, speed
that of the tool over 20 m/s, safety over 0.35, body the size of the cylinder over 20 um. A run takes steps and particle-steps as the scene's cells say, and RATE s for
each, much more with levels. Variables of the environment: PRETEND_A, PRETEND_ORDER, PRETEND_B, PRETEND_Q, PRETEND_C, PRETEND_D;
PRETEND_FILL is added in proportion to h where the body is filled by shares. PRETEND_JUMP adds an error to cells below a size (um) that no coarser one has; PRETEND_REFUSED is a list of
cells (um) that are refused; PRETEND_SECTION: bodies have a section, and what is no section has that much more error in
proportion to h; PRETEND_LOG a file that gets a line a run. PRETEND_SHARE (%): other jobs have the
processor for the rest, by turns more and less, and all takes as much longer. PRETEND_PLAN: a plan says so
many times what it will be."""

import json
import os
import sys
from pathlib import Path

import numpy as np

from gimp3d.run_data import read_namelists

RATE = 2e-7  # s
number = lambda name, default: float(os.environ.get(f"PRETEND_{name}", default))
text = sys.stdin.read()
if "--section" in sys.argv:
    if "PRETEND_SECTION" not in os.environ:
        print("gimp3d: line 3, &body: is no body of revolution here", file=sys.stderr)
        sys.exit(2)
    print(text.replace("&grid", "&grid geometry='axisymmetric',"))
    sys.exit()
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
flat = "geometry" in grid
particles = (1000 / cell**2 if flat else 50000 / cell**3) * (body**3 + 0.5 * levels)
updates = steps * particles * (1 + levels)
seconds = RATE * updates * (1 + 1.5 * levels) + 1e-4 * steps
megabytes = 3e-4 * particles
with open(os.environ["PRETEND_LOG"]) as log:
    turn = len(log.readlines()) % 3
share = number("SHARE", 100) * (1, 0.5, 0.8)[turn] if "PRETEND_SHARE" in os.environ else 100.0
seconds *= 100 / share
if plans:
    seconds *= number("PLAN", 1)
    figures = {
        "steps": round(steps),
        "particle_steps": round(updates),
        "time_s": seconds + 0.5,
        "output_s": 0.5,
        "memory_B": 1e6 * megabytes,
        "processor_share": share / 100,
    }
    Path(sys.argv[sys.argv.index("--json") + 1]).write_text(json.dumps(figures))
    sys.exit()
error = (
    number("A", 0.02) * finest ** number("ORDER", 1.5)
    + number("B", 0) * speed * body
    + number("C", 0) * safety
)
if not flat:
    error += number("SECTION", 0) * finest
error += number("Q", 0) * speed**2 + number("D", 0) / body
if case["body"][0].get("fill", ["whole"])[0] == "share":
    error += number("FILL", 0) * finest
if finest < number("JUMP", 0):
    error += 0.05
time = np.linspace(0, scene["end_time"][0], 201)
depth = np.interp(time, tool["times"], np.array([0, 0.5e-6]))
depth = 0.5e-6 * time / time[-1]
part = 1.0 if flat else 0.25
load = 4e9 * part * depth**1.5 * (1 + error)
Path("tool_sphere.dat").write_text(
    'TITLE = "pretended"\nVARIABLES = "time [s]" "depth [m]" "load_x [N]" "load_y [N]" "load_z [N]"\n'
    f'ZONE T="history", STRANDID=1, SOLUTIONTIME=0\nAUXDATA model_share="{part}"\n'
    + "".join(f"{t:.10e} {d:.10e} 0 0 {f:.10e}\n" for t, d, f in zip(time, depth, load))
)
notes = {
    "phase_1": "all",
    "particles_at_start": round(particles),
    "steps": round(steps),
    "particle_steps": round(updates),
    "memory_at_start_B": 1e6 * megabytes,
    "processor_share": share / 100,
}
Path("cost.dat").write_text(
    "".join(f'AUXDATA {name}="{value}"\n' for name, value in notes.items())
    + f"1 {seconds:.9g} {seconds:.9g} {seconds:.9g}\n"
)
