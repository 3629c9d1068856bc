"""What the scripts of this suite measure in runs: figures with their bounds, and files that must be the same
to the bit."""

from pathlib import Path

import h5py
import numpy as np

from checks import check, finish, require  # scripts may take these from here too
from gimp3d.run_data import History, Particles


def energy(directory):
    """energy.dat as vectors: every value finite."""
    history = History(Path(directory) / "energy.dat")
    require(f"{directory}/energy.dat: some rows", history.rows > 10)
    for name, values in history.columns.items():
        require(f"{directory}/energy.dat: {name} is finite", bool(np.all(np.isfinite(values))))
    return history


def vector(history, name):
    return np.stack([history[f"{name}_{axis}"] for axis in "xyz"], axis=1)


def snapshots(directory):
    paths = sorted(Path(directory).glob("particles_*.hdf"))
    require(f"{directory}: snapshots", len(paths) > 1)
    return [Particles(path) for path in paths]


def stress(directory):
    """Largest stress component of all snapshots."""
    return max(float(np.abs(one.fields["stress"]).max()) for one in snapshots(directory))


def conserved(directory, of_mass, of_momentum, of_angular):
    """Mass, momentum, angular momentum over a run, relative to what is there."""
    history = energy(directory)
    mass, momentum, angular = (
        history["mass"],
        vector(history, "momentum"),
        vector(history, "angular_momentum"),
    )
    masses = [one.fields["mass"][np.argsort(one.ids)] for one in snapshots(directory)]
    require(
        f"{directory}: every particle keeps its mass to the bit",
        all(np.array_equal(masses[0], m) for m in masses),
    )
    check(f"{directory}: change of the sum of masses, relative", mass / mass[0] - 1, of_mass)
    scale = max(np.linalg.norm(momentum[0]), np.sqrt(2 * mass[0] * history["kinetic"][0]))
    check(f"{directory}: change of momentum over |momentum|", (momentum - momentum[0]) / scale, of_momentum)
    drift = np.linalg.norm(angular - angular[0], axis=1) / np.linalg.norm(angular[0])
    check(f"{directory}: change of angular momentum, relative", drift, of_angular)
    return history


def everything(path):
    """All data sets and attributes of a file, by name."""
    found = {}
    with h5py.File(path, "r") as file:

        def take(name, thing):
            for key, value in thing.attrs.items():
                found[f"{name}@{key}"] = np.asarray(value)
            if isinstance(thing, h5py.Dataset):
                found[name] = thing[...]

        take("/", file)
        file.visititems(take)
    return found


def same_bits(one, other):
    """Every file of particles and every history of two runs, to the bit and in the same order."""
    names = [
        sorted(
            path.name
            for pattern in ("particles_*.hdf", "energy.dat", "probe_*.dat")
            for path in Path(run).glob(pattern)
        )
        for run in (one, other)
    ]
    require(f"{one} and {other} hold the same files", names[0] == names[1] and len(names[0]) > 2)
    compared = 0
    for name in names[0]:
        if name.endswith(".dat"):
            require(
                f"{name} of {one} and {other}",
                (Path(one) / name).read_bytes() == (Path(other) / name).read_bytes(),
            )
            continue
        a, b = everything(Path(one) / name), everything(Path(other) / name)
        require(f"{name} of {one} and {other}: the same tables", a.keys() == b.keys())
        for table in a:
            same = a[table].dtype == b[table].dtype and a[table].tobytes() == b[table].tobytes()
            require(f"{name} of {one} and {other}: {table}", same)
            compared += a[table].size
    print(f"   {one} and {other}: {len(names[0])} files, {compared} values, the same bits")
