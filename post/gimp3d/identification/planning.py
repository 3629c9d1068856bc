"""What runs will take: the program's own forecast of one of them, and the work of the others beside it."""

import json
import subprocess
import tempfile
from pathlib import Path

from ..api import RunFailed
from ..launch import find_program
from . import forward

OVERHEAD = 1.0  # s that a run takes besides its steps: start, output, reading


def work(case):
    """Particle-steps of a case, about: steps of the finest cells, which the levels share, over their
    particles."""
    numerics = case.numerics
    end = forward.motion(case)[2]
    steps = end * numerics.cells / (0.35 * forward.DEPTH)
    own = 4 * numerics.fine**2
    coarser = sum(0.75 * own / 2**level for level in range(1, numerics.levels + 1))
    return steps * (own + coarser)


def seconds_of(case, program=None):
    """Of a case, by the program's forecast."""
    return seconds_of_scene(forward.scene_text(case), program)


def seconds_of_scene(scene, program=None):
    """Of a scene's text, by the program's forecast."""
    return forecast(scene, program)["time_s"]


def forecast(scene, program=None):
    """The figures of the program's plan. Raises RunFailed with its sentence where it does not take the
    scene."""
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder) / "plan.json"
        done = subprocess.run(
            [find_program(program), "--plan", "--json", str(plan)],
            input=scene, text=True, capture_output=True, cwd=folder,
        )  # fmt: skip
        if done.returncode or not plan.is_file():
            raise RunFailed(done.returncode or 1, done.stderr.strip()[-500:] or "the plan is not there")
        return json.loads(plan.read_text())


def minutes_of(cases, cores, program=None):
    """Of all cases on some cores."""
    if not cases:
        return 0.0
    typical = sorted(cases, key=work)[len(cases) // 2]
    pace = seconds_of(typical, program) / work(typical)
    return (sum(map(work, cases)) * pace + OVERHEAD * len(cases)) / cores / 60
