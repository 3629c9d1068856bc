"""What the scripts of this suite share: a scene run from its text, and probes in the middle of particles."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
from gimp3d.run_data import History


def run(text, ranks, allowed=(0,)):
    """Run a scene; its standard output and error. A status that is not allowed ends the test."""
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), os.environ["GIMP3D"]], input=text, capture_output=True, text=True
    )
    if done.returncode not in allowed:
        sys.exit(
            f"FAILED: ended with status {done.returncode}:\n{text}\n{done.stdout[-1500:]}{done.stderr[-800:]}"
        )
    return done.stdout + done.stderr


def seconds_and_particles(log):
    return float(re.search(r"^all +\S+ +(\S+)", log, re.M)[1]), int(
        re.search(r"^particles +(\d+)", log, re.M)[1]
    )


def probe(directory, name):
    return History(Path(directory) / f"probe_{name}.dat")


def replace(text, old, new):
    """Replace exactly one place of a scene."""
    if text.count(old) != 1:
        sys.exit(f"FAILED: {old!r} stands {text.count(old)} times in the scene")
    return text.replace(old, new)
