#!/usr/bin/env python3
"""Heights of a microscope's file as a map for shape='surface': HDF5 with the dataset `height` in m, rows along
y from the bottom, and its attribute `spacing` (x, y) in m.

    heights.py FILE.gwy [OUT.h5] [--channel N]

Reads Gwyddion's own files; N is the channel's number in Gwyddion. Scenes
then say no more than `shape='surface', file='OUT.h5'`, and `rotation=180,0,0` for a tip that was measured upside up.
Masks are not looked at. Other instruments' files (.sur, .x3p, .sdf, .plux, .vk4, .dat, .opd, ...) go through Gwyddion,
which reads them and saves .gwy."""

import argparse
import re
import sys
from pathlib import Path

import h5py
import numpy as np

from . import gwyddion

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "Å": 1e-10, "pm": 1e-12}
LENGTHS |= {"µm": 1e-6, "μm": 1e-6, "Angstrom": 1e-10}  # the micro sign, and the Greek letter


def unit_of(field, which):
    """The name of a field's unit, '' where it has none."""
    unit = field.get(which)
    return str(unit.get("unitstr", "")).strip() if hasattr(unit, "get") else ""


def channels_of(container):
    """All images of a file by their numbers: (title, field)."""
    numbers = (re.fullmatch(r"/(\d+)/data", str(key)) for key in container)
    return {
        int(n[1]): (str(container.get(f"{n[0]}/title", "without a title")), container[n[0]])
        for n in numbers
        if n and hasattr(container[n[0]], "get")
    }


def chosen(channels, number):
    """The field of heights of that number, or the only one there is."""
    named = lambda which: ", ".join(f"{n} {channels[n][0]!r}" for n in sorted(which))
    of_heights = {n for n, (_, field) in channels.items() if unit_of(field, "si_unit_z") in LENGTHS}
    if not of_heights:
        raise ValueError(f"has no channel of heights; it has {named(channels) or 'no images'}")
    if number is None and len(of_heights) > 1:
        raise ValueError(f"has several channels of heights; say --channel: {named(of_heights)}")
    if number is not None and number not in of_heights:
        raise ValueError(f"has no channel {number} of heights; allowed: {named(of_heights)}")
    return channels[of_heights.pop() if number is None else number][1]


def read_gwy(path, channel=None):
    """Heights (along y from the bottom, along x) in m, and the distances along x and y in m. A file with
    several channels of heights needs `channel`, its number; ValueError says which there are."""
    with open(path, "rb") as file:
        if file.read(4) != gwyddion.MAGIC:
            raise ValueError(
                "is no file of Gwyddion (it begins otherwise); Gwyddion reads others and saves .gwy"
            )
    try:
        channels = channels_of(gwyddion.load(path))
    except gwyddion.Damaged as error:
        raise ValueError(f"is damaged: {error}") from None
    field = chosen(channels, channel)
    lateral = unit_of(field, "si_unit_xy") or "m"
    if lateral not in LENGTHS:
        raise ValueError(f"has distances along x and y in {lateral!r}, which is no length")
    try:
        columns, rows = int(field["xres"]), int(field["yres"])
        sides = float(field["xreal"]), float(field["yreal"])
        numbers = np.asarray(field["data"], float).ravel()
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"is damaged ({type(error).__name__}: {error})") from None
    if min(columns, rows) < 2 or numbers.size != columns * rows:
        raise ValueError(f"is damaged: {numbers.size} heights for {columns} columns and {rows} rows")
    spacing = tuple(LENGTHS[lateral] * side / count for side, count in zip(sides, (columns, rows)))
    if not all(np.isfinite(spacing)) or min(spacing) <= 0:
        raise ValueError(f"is damaged: it is {sides[0]:g} by {sides[1]:g} {lateral} wide")
    heights = (
        LENGTHS[unit_of(field, "si_unit_z")] * numbers.reshape(rows, columns)[::-1]
    )  # its first row is on top
    if not np.isfinite(heights).all():
        raise ValueError("holds heights that are not finite numbers; fill them by their neighbours")
    return heights, spacing


def write(path, heights, spacing):
    """The map that `shape='surface'` reads."""
    with h5py.File(path, "w") as file:
        data = file.create_dataset("height", data=np.asarray(heights, float))
        data.attrs["spacing"] = np.asarray(spacing, float)
        data.attrs["unit"] = "m"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("out", type=Path, nargs="?")
    parser.add_argument("--channel", type=int)
    arguments = parser.parse_args()
    try:
        heights, spacing = read_gwy(arguments.file, arguments.channel)
        out = arguments.out or arguments.file.with_suffix(".h5")
        write(out, heights, spacing)
    except (ValueError, OSError) as error:
        print(f"{arguments.file}: {error}", file=sys.stderr)
        return 2
    print(
        f"{out}: {heights.shape[1]} by {heights.shape[0]} heights from "
        f"{heights.min():.4g} to {heights.max():.4g} m, "
        f"{spacing[0]:.4g} by {spacing[1]:.4g} m apart"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
