#!/usr/bin/env python3
"""Heights of a microscope's file as a map for shape='surface': HDF5 with the dataset `height` in m, rows along
y from the bottom, and its attribute `spacing` (x, y) in m.

    heights.py FILE.gwy [OUT.h5] [--channel N]

Reads Gwyddion's files (package gwyfile, `pip install gwyfile`). Scenes then say no more than
`shape='surface', file='OUT.h5'`, and `rotation=180,0,0` for a tip that was measured upside up."""

import argparse
import sys
from pathlib import Path

import h5py
import numpy as np


def read_gwy(path, channel=None):
    """Heights (along y from the bottom, along x) in m, and the distances along x and y in m. A file with
    several channels of heights needs `channel`, its number; ValueError says which there are."""
    try:
        import gwyfile
    except ImportError:
        raise ValueError("the package gwyfile is not there: pip install gwyfile") from None
    try:
        fields = gwyfile.util.get_datafields(gwyfile.load(str(path)))
    except Exception as error:
        raise ValueError(f"is no file of Gwyddion ({error})") from None
    lengths = {}
    for title, field in fields.items():
        unit = field.get("si_unit_z")
        if unit is not None and unit.get("unitstr", "") in ("m", "nm", "um", "mm"):
            lengths[title] = field
    if not lengths:
        raise ValueError(f"has no channel of heights; it has {', '.join(fields) or 'none'}")
    titles = list(lengths)
    if channel is None and len(titles) > 1:
        names = ", ".join(f"{n} {title}" for n, title in enumerate(titles))
        raise ValueError(f"has several channels of heights; say --channel: {names}")
    if channel is not None and not 0 <= channel < len(titles):
        raise ValueError(f"has no channel {channel}; allowed: 0 to {len(titles) - 1}")
    field = lengths[titles[channel or 0]]
    factor = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
    lateral = field.get("si_unit_xy")
    across = factor.get(lateral.get("unitstr", "m") if lateral is not None else "m", 0.0)
    if not across:
        raise ValueError("has distances along x and y in no unit of length")
    heights = (
        factor[field["si_unit_z"]["unitstr"]] * np.asarray(field.data, float)[::-1]
    )  # its first row is on top
    spacing = across * field.xreal / heights.shape[1], across * field.yreal / heights.shape[0]
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
    except (ValueError, OSError) as error:
        print(f"{arguments.file}: {error}", file=sys.stderr)
        return 2
    out = arguments.out or arguments.file.with_suffix(".h5")
    write(out, heights, spacing)
    print(
        f"{out}: {heights.shape[1]} by {heights.shape[0]} heights from "
        f"{heights.min():.4g} to {heights.max():.4g} m, "
        f"{spacing[0]:.4g} by {spacing[1]:.4g} m apart"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
