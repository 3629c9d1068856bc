"""`make solve` with the program, on a cheap scene with an exact answer. usage: solve_bar.py ROOT GIMP3D"""

import json
import subprocess
import sys
from pathlib import Path


ROOT, GIMP3D = Path(sys.argv[1]), sys.argv[2]
from gimp3d import study_fit
from gimp3d import study_quantity
from checks import finish, require


def solve(error, *options, scene=ROOT / "input/bar.nml", out="out"):
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "gimp3d",
            "solve",
            scene,
            "--quantity",
            "displacement",
            "--error",
            str(error),
            "--out",
            out,
            "--program",
            GIMP3D,
            *options,
        ],
        capture_output=True,
        text=True,
    )
    print(done.stdout + done.stderr)
    return done.returncode, done.stdout, done.stderr


class Known:
    """A run of the bar as study_quantity sees it, for the exact curve."""

    def __init__(self, answer):
        from gimp3d.run_data import read_namelists

        self.directory = Path(answer["run"])
        self.case = read_namelists(self.directory / "scene.nml")
        self.settings = answer["settings"]


class Quantity:
    name, kind, probe, point, column, window, smooth = (
        "displacement",
        "probe",
        "end",
        (),
        "displacement_z",
        (0, 1),
        0,
    )


for error in (5, 2):
    status, said, _ = solve(error, out=f"out_{error}")
    answer = json.loads(Path(f"out_{error}/answer.json").read_text())
    run = Known(answer)
    x, exact = study_quantity.suddenly_heavy_bar(run, Quantity)
    _, found = study_quantity.curve_of(run, Quantity)
    true, _ = study_fit.norms(found, exact)
    require(f"{error} %: the price stands before the run", said.index("predicted") < said.index("reached"))
    require(
        f"{error} %: met ({answer['error']:.2g} +- {answer['error_uncertainty']:.2g} %) and truly so "
        f"({true:.2g} %)",
        status == 0 and answer["met"] and true <= error,
    )
    require(f"{error} %: chosen.nml is a scene", "&grid" in Path(f"out_{error}/chosen.nml").read_text())
cells = [json.loads(Path(f"out_{error}/answer.json").read_text())["settings"]["cell"] for error in (5, 2)]
require(
    f"cells of {cells[0]:.3g} m for 5 % are not finer than those for 2 %, {cells[1]:.3g} m",
    cells[0] >= cells[1],
)
status, said, _ = solve(0.001, "--budget", "4", out="out_never")
require("a target out of reach is told, status 1", status == 1)
status, _, wrong = solve(1, scene=Path("none.nml"), out="out_none")
require("no such scene: status 2 and a sentence", status == 2 and wrong == "solve: none.nml: no such scene\n")
finish()
