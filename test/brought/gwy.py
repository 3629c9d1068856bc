"""Gwyddion's own files, made by a writer of our own, through `gimp3d-post heights` into a body: the same numbers, and
the same body as of a matrix of text. What is refused, and 40 changed copies, in one sentence each."""

import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

import writers
from checks import finish, require
from mutations import mutated

SPACING = (5e-8, 4e-8)
SCENE = """&scene title='{name}', end_time=1e-12 /
&grid lower=-2e-6,-2e-6,-4e-6, upper=2e-6,2e-6,2e-6, cell_size=4e-7 /
&material name='m', model='elastic', density=2000, young=1e9, poisson=0.3 /
&body material='m', shape='surface', file='{file}'{more}, particles_per_cell=1, fill='share' /
&output directory='out/{name}' /
"""


def heights(path, *options):
    """Status and what `gimp3d-post heights` says."""
    done = subprocess.run(
        [sys.executable, "-m", "gimp3d", "heights", str(path), *options], capture_output=True, text=True
    )
    return done.returncode, done.stderr.strip() if done.returncode else done.stdout.strip()


def refused(name, content, sentence, *options):
    Path("bad.gwy").write_bytes(content)
    Path("bad.h5").unlink(missing_ok=True)
    status, said = heights("bad.gwy", *options)
    good = status == 2 and sentence in said and "\n" not in said and not Path("bad.h5").exists()
    require(f"{name}: {said}", good)


def centre(name, file, more=""):
    """Mass (kg) and centre of mass (m) of the body of a map."""
    scene = SCENE.format(name=name, file=file, more=more)
    done = subprocess.run([os.environ["GIMP3D"]], input=scene, capture_output=True, text=True)
    require(f"{name}: {done.stderr}", done.returncode == 0)
    with h5py.File(sorted(Path(f"out/{name}").glob("particles_*.hdf"))[0]) as particles:
        points, mass = particles["VTKHDF/Points"][()], particles["VTKHDF/PointData/mass"][()]
    return mass.sum(), (points * mass[:, None]).sum(axis=0) / mass.sum()


def main():
    y, x = np.mgrid[:31, :41]  # a hill that no turn or mirror brings onto itself
    hill = 2e-7 * np.exp(-(((x - 12) / 9) ** 2) - ((y - 20) / 6) ** 2) + 3e-9 * x + 1e-9 * y
    made = writers.gwy((0, "Height", hill, SPACING, "m"), (3, "Amplitude", 1e7 * hill, SPACING, "V"))
    Path("hill.gwy").write_bytes(made)
    status, said = heights("hill.gwy")
    require(f"read: {said}", status == 0 and "41 by 31" in said)
    with h5py.File("hill.h5") as file:
        data = file["height"]
        require("every height as it was, from the bottom on", np.array_equal(data[()], hill))
        require("distances", np.allclose(data.attrs["spacing"], SPACING, rtol=1e-14))
    Path("hill.txt").write_bytes(writers.matrix(hill))
    Path("mirrored.txt").write_bytes(writers.matrix(hill, top=True))
    mass, middle = centre("gwy", "hill.h5")
    text_mass, text_middle = centre("text", "hill.txt", ", spacing=5e-8,4e-8")
    require(
        f"the body of a matrix of text: mass {mass / text_mass - 1:+.1e}", abs(mass / text_mass - 1) < 1e-6
    )
    require(
        f"its middle {np.abs(middle - text_middle).max():.1e} m off",
        np.allclose(middle, text_middle, atol=1e-11),
    )
    _, wrong = centre("mirrored", "mirrored.txt", ", spacing=5e-8,4e-8")
    require("a mirrored one would be seen", np.abs(middle - wrong).max() > 1e-8)
    twice = writers.gwy((0, "Height", hill, SPACING, "m"), (2, "Height", 2 * hill, SPACING, "m"))
    refused("two of one title", twice, "several channels of heights; say --channel: 0 'Height', 2 'Height'")
    refused(
        "a number that is not there",
        twice,
        "no channel 1 of heights; allowed: 0 'Height', 2",
        "--channel",
        "1",
    )
    Path("twice.gwy").write_bytes(twice)
    status, said = heights("twice.gwy", "second.h5", "--channel", "2")
    with h5py.File("second.h5") as file:
        require("the second channel", status == 0 and np.array_equal(file["height"][()], 2 * hill))
    for unit, factor in (("nm", 1e-9), ("µm", 1e-6)):
        Path("unit.gwy").write_bytes(writers.gwy((0, "Height", hill / factor, SPACING, unit)))
        status, said = heights("unit.gwy")
        with h5py.File("unit.h5") as file:
            require(f"heights in {unit}", status == 0 and np.allclose(file["height"][()], hill, rtol=1e-12))
    volts = writers.gwy((0, "Amplitude", hill, SPACING, "V"))
    refused("no heights", volts, "no channel of heights; it has 0 'Amplitude'")
    refused("not a number", writers.gwy((0, "H", hill * np.nan, SPACING, "m")), "not finite")
    refused("another file", b"\0" * 300, "is no file of Gwyddion")
    refused("cut short", made[: len(made) // 2], "is damaged")
    changed(made)
    finish()


def changed(content, count=40):
    """Read or refused, never a traceback, in this process."""
    from gimp3d.heights import read_gwy

    chance, read, strange = np.random.default_rng(11), 0, []
    for number in range(count):
        Path("changed.gwy").write_bytes(mutated(content, chance))
        try:
            read_gwy("changed.gwy")
            read += 1
        except ValueError as error:
            if "\n" in str(error):
                strange.append(f"{number}: {error}")
        except Exception as error:
            strange.append(f"{number}: {type(error).__name__}: {error}")
    require(f"{count} changed files: {read} read, {count - read} refused {strange}", not strange)


main()
