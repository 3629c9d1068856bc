"""The last snapshot of a run, and how far two fields are apart."""

from pathlib import Path

import numpy as np
from gimp3d.run_data import Particles


def newest(directory):
    """The fields of the last snapshot, by id."""
    particles = Particles(sorted(Path(directory).glob("particles_*.hdf"))[-1])
    order = np.argsort(particles.ids)
    return {name: np.asarray(data)[order] for name, data in particles.fields.items()}


def far(a, b):
    return np.abs(a - b).max() / max(np.abs(b).max(), 1e-300)
