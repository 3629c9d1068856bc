"""`make solve` of a body of revolution takes its section for pilots: the run of the quarter model that it chose
differs from finite elements on the same body by the error that it said, within its uncertainty.
usage: solve_section.py ROOT GIMP3D"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT, GIMP3D = Path(sys.argv[1]), sys.argv[2]
from checks import finish, require
from gimp3d.indentation import share_of_body
from gimp3d.run_data import History, read_namelists

TARGET = 2.0  # per cent

done = subprocess.run(
    [sys.executable, "-m", "gimp3d", "solve", ROOT / "input/hertz.nml", "--quantity", "load"]
    + ["--error", str(TARGET), "--budget", "600", "--out", "out", "--program", GIMP3D],
    capture_output=True,
    text=True,
)
print(done.stdout + done.stderr)
if done.returncode:
    sys.exit(f"FAILED  status {done.returncode}")
answer = json.loads(Path("out/answer.json").read_text())
section = answer["section"]
require("the log says that pilots are sections", "section    pilots are given by the section" in done.stdout)
require(
    f"{section['pilots']} of them took {section['seconds']:.3g} s, on the same cells "
    f"{section['price']:.3f} of the quarter model's time",
    section["pilots"] >= 8 and section["price"] < 0.1,
)
grid = read_namelists((Path(answer["run"]) / "scene.nml").read_text())["grid"][0]
require("the answer is a run of the scene itself", "geometry" not in grid)

history = History(Path(answer["run"]) / "tool_sphere.dat")
depth, load = history["depth"], history["load_z"] / share_of_body(history)
table = np.loadtxt(ROOT / "test/references/fem/sphere_hypo_h0.1.csv", delimiter=",", comments="#")
elements = np.interp(depth * 1e6, table[:, 0], table[:, 1]) * 1e-6
late = depth > 0.5 * depth[-1]
off = 100 * float(np.sqrt(np.mean((load - elements)[late] ** 2))) / elements[-1]
require(
    f"{answer['settings']}: {answer['error']:.3g} +- {answer['error_uncertainty']:.3g} % said, "
    f"{off:.3g} % off finite elements",
    abs(off - answer["error"]) < answer["error_uncertainty"] and off < TARGET,
)
finish()
