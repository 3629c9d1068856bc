"""What runs will take: the program's own forecast of some of them, and the work of the others beside it.

Seconds are of the processor: on a machine that others use too a run waits, and how long is not known before.
The share of a processor that the forecasts got says what that makes of the clock, if the others go on."""

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

OVERHEAD = 0.4  # s of the processor that a run takes besides its steps: start, output, reading
DISTURBED = 1.4  # a forecast that is so much dearer than the cheapest is left out
TRIED = (0.1, 0.5, 0.9)  # places among the cases, by their work, that are forecast


def work(case):
    """Particle-steps of a case, about: steps of the finest cells, which the levels share, over their
    particles."""
    numerics = case.numerics
    end = forward.motion(case)[2]
    steps = end * numerics.cells / (0.35 * forward.DEPTH * case.width)
    own = 4 * numerics.fine**2
    coarser = sum(0.75 * own / 2**level for level in range(1, numerics.levels + 1))
    return steps * (own + coarser)


@dataclass
class Price:
    """Seconds of the processor, and minutes by the clock at the present load of the machine."""

    seconds: float = 0.0
    minutes: float = 0.0

    @property
    def words(self):
        return (
            f"{self.seconds:.3g} s of the processor, {self.minutes:.2g} minutes at the machine's present load"
        )


def seconds_of_scene(scene, program=None):
    """Seconds of the processor of a scene's text, by the program's forecast, and the share of a processor
    that it got."""
    found = forecast(scene, program)
    share = min(max(found.get("processor_share", 1.0), 0.01), 1.0)
    return found["time_s"] * share, share


def spent():
    """Seconds of the processor that this process and its children have had."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


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
