"""What the scripts of this suite share: scenes with &quasi_static, and what runs of them say."""

import re
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from gimp3d.run_data import History, Particles
from run_scene import run
from checks import check, finish, require


def last_particles(directory):
    """The last snapshot, in the order of ids."""
    paths = sorted(
        Path(directory).glob("particles_*.hdf"), key=lambda path: int(re.search(r"(\d+)\.hdf", path.name)[1])
    )
    particles = Particles(paths[-1])
    order = np.argsort(particles.ids)
    return {name: values[order] for name, values in particles.fields.items()}


def first_particles(directory):
    particles = Particles(Path(directory) / "particles_00000000.hdf")
    order = np.argsort(particles.ids)
    return {name: values[order] for name, values in particles.fields.items()}


def tool(directory, name):
    return History(Path(directory) / f"tool_{name}.dat")


def counts(log, kind=""):
    """Steps; Newton iterations, solves and products a step; times halved."""
    names = ("implicit_steps", "newton_iterations", "linear_solves", "linear_products", "steps_halved")
    steps, newton, solves, products, halved = (log.figures[name] for name in names)
    return [steps, newton / steps, solves / steps, products / steps, halved]


def newton_by_step(log):
    """Newton iterations of each step that was tried, where the run tells them."""
    numbers = [int(value) for value in re.findall(r"^newton +(\d+):", log, re.M)]
    return [before for before, after in zip(numbers, numbers[1:] + [0]) if after == 0]
