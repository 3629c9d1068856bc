"""Forecast of the computing time of runs: the program's own forecast for some of them, scaled to the others
by their number of particle steps.

Seconds are CPU time. The elapsed time depends on the load of the machine; it is estimated from the share of
CPU time that the forecasts received."""

import json
import resource
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from ..api import RunFailed
from ..launch import find_program
from . import forward

OVERHEAD = 0.4  # CPU time of a run besides its steps, s: start, output, reading
DISTURBED = 1.4  # forecasts that exceed the lowest one by this factor are left out
TRIED = (0.1, 0.5, 0.9)  # quantiles of the cases, by their work, that are forecast


def work(case):
    """Estimated particle steps of a case: time steps of the finest cells, which all levels share, times the
    number of particles."""
    numerics = case.numerics
    end = forward.motion(case)[2]
    steps = end * numerics.cells / (0.35 * forward.DEPTH * case.width)
    own = 4 * numerics.fine**2
    coarser = sum(0.75 * own / 2**level for level in range(1, numerics.levels + 1))
    return steps * (own + coarser)


@dataclass
class Price:
    """seconds: CPU time; minutes: elapsed time at the present load of the machine."""

    seconds: float = 0.0
    minutes: float = 0.0

    @property
    def words(self):
        return f"{self.seconds:.3g} s of CPU time, {self.minutes:.2g} min elapsed at the present load"


def seconds_of_scene(scene, program=None):
    """CPU time of a scene (s) by the program's forecast, and the share of a processor that the forecast
    received."""
    found = forecast(scene, program)
    share = min(max(found.get("processor_share", 1.0), 0.01), 1.0)
    return found["time_s"] * share, share


def spent():
    """CPU time (s) of this process and its children."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def forecast(scene, program=None):
    """The numbers of the program's plan. Raises RunFailed with the program's message if it rejects the
    scene."""
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder) / "plan.json"
        done = subprocess.run(
            [find_program(program), "--plan", "--json", str(plan)],
            input=scene, text=True, capture_output=True, cwd=folder,
        )  # fmt: skip
        if done.returncode or not plan.is_file():
            raise RunFailed(done.returncode or 1, done.stderr.strip()[-500:] or "the program wrote no plan")
        return json.loads(plan.read_text())


def price_of(cases, cores, program=None):
    """The Price of all cases on some cores."""
    if not cases:
        return Price()
    ordered = sorted(cases, key=work)
    tried = [ordered[int(place * (len(ordered) - 1))] for place in TRIED]
    found = [seconds_of_scene(forward.scene_text(case), program) for case in tried]
    paces = [seconds / work(case) for (seconds, _), case in zip(found, tried)]
    calm = [k for k, pace in enumerate(paces) if pace < DISTURBED * min(paces)]  # others disturb only upwards
    pace = sum(found[k][0] for k in calm) / sum(work(tried[k]) for k in calm)
    share = sum(share for _, share in found) / len(found)
    seconds = sum(map(work, cases)) * pace + OVERHEAD * len(cases)
    return Price(seconds, seconds / share / cores / 60)
