"""`make solve` for a half-space beside Hertz's own load: the run that it chose differs from that by the error
that it said, within its uncertainty; the body of the scene alone is farther off than what was asked for.
usage: solve_half_space.py ROOT GIMP3D"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT, GIMP3D = Path(sys.argv[1]), sys.argv[2]
from gimp3d.indentation import share_of_body
from gimp3d.run_data import History, read_namelists

TARGET = 4.0  # per cent
young, poisson, radius = 70e9, 0.33, 10e-6  # of the scene


def from_hertz(run):
    """Rms over the second half of the depth, per cent of the largest load."""
    history = History(Path(run) / "tool_sphere.dat")
    depth, load = history["depth"], history["load_z"] / share_of_body(history)
    hertz = 4 / 3 * young / (1 - poisson**2) * np.sqrt(radius) * np.maximum(depth, 0) ** 1.5
    late = depth > 0.5 * depth[-1]
    return 100 * float(np.sqrt(np.mean((load - hertz)[late] ** 2))) / hertz[-1]


done = subprocess.run(
    [sys.executable, "-m", "gimp3d", "solve", ROOT / "input/hertz.nml", "--quantity", "load", "--half-space"]
    + ["--error", str(TARGET), "--budget", "1500", "--out", "out", "--program", GIMP3D],
    capture_output=True,
    text=True,
)
print(done.stdout + done.stderr)
if done.returncode:
    sys.exit(f"FAILED  status {done.returncode}")
answer = json.loads(Path("out/answer.json").read_text())
of_scene = [
    run
    for run in Path("out/runs").iterdir()
    if abs(read_namelists((run / "scene.nml").read_text())["body"][0]["radius"][0] / 20e-6 - 1) < 1e-9
]
off, alone = from_hertz(answer["run"]), min(from_hertz(run) for run in of_scene)
faults = 0
for what, holds in (
    (
        f"{answer['settings']}: {answer['error']:.3g} +- {answer['error_uncertainty']:.3g} % said, "
        f"{off:.3g} % from Hertz",
        abs(off - answer["error"]) < answer["error_uncertainty"] and off < TARGET,
    ),
    (f"the scene's body is {alone:.3g} % from Hertz at best", alone > TARGET),
):
    print(("ok      " if holds else "FAILED  ") + what)
    faults += not holds
sys.exit(bool(faults))
