"""What the scripts of this suite share: a scene run from its text, and probes in the middle of particles."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
from gimp3d.run_data import History


class Said(str):
    """What a run printed; `figures` has the numbers of its end by name (those of --json)."""


def run(text, ranks, allowed=(0,)):
    """Run a scene; its standard output and error (Said). A status that is not allowed ends the test."""
    figures = Path("figures.json")
    figures.unlink(missing_ok=True)
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), os.environ["GIMP3D"], "--json", str(figures)],
        input=text,
        capture_output=True,
        text=True,
    )
    if done.returncode not in allowed:
        sys.exit(
            f"FAILED: ended with status {done.returncode}:\n{text}\n{done.stdout[-1500:]}{done.stderr[-800:]}"
        )
    said = Said(done.stdout + done.stderr)
    said.figures = json.loads(figures.read_text()) if figures.is_file() else {}
    return said


def seconds_and_particles(log):
    return log.figures["wall_s"], int(log.figures["particles_at_start"])


def probe(directory, name):
    return History(Path(directory) / f"probe_{name}.dat")


def replace(text, old, new):
    """Replace exactly one place of a scene."""
    if text.count(old) != 1:
        sys.exit(f"FAILED: {old!r} stands {text.count(old)} times in the scene")
    return text.replace(old, new)
