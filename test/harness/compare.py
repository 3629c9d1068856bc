#!/usr/bin/env python3
"""Compare what a run wrote with a reference.

   compare.py [options] REFERENCE RESULT

Both are histories (.dat, Tecplot ASCII, point packing), particle files (.hdf or .h5, compared by particle id), or
directories, in which every .dat and .hdf of either must be in both. A value may differ by its tolerance times
the column's scale, which is the largest magnitude of the column in the reference (of the whole vector or
tensor for particle fields). A NaN, an infinity, a missing or an extra column, row, particle or file is a
difference.

   --tolerance X           of every column that is not named (1e-12)
   --column NAME=X         of this column
   --scale NAME=X          take this scale, in the column's unit, instead of the reference's largest magnitude
   --ignore NAME           not compared (it may also be absent)

Names are given without their units. Exit status: 0 the same, 1 different, 2 wrong usage.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from gimp3d.run_data import History, Particles, Unreadable


def sorted_fields(particles, path):
    """Ids in order, the fields in that order, and the time as a field."""
    if np.unique(particles.ids).size != particles.ids.size:
        raise Unreadable(f"{path}: an id stands twice")
    order = np.argsort(particles.ids)
    fields = {name: data[order].astype(float) for name, data in particles.fields.items()}
    fields["time"] = np.full(1, particles.time)
    return particles.ids[order], fields


def compare_columns(where, reference, result, options, row_name):
    """The differences between two sets of columns, as sentences; row_name says which row it is."""
    found = []
    for name in sorted((set(reference) | set(result)) - set(options.ignore)):
        if name not in result:
            found.append(f"{where}: {name} is missing")
            continue
        if name not in reference:
            found.append(f"{where}: {name} is not in the reference")
            continue
        expected, value = reference[name], result[name]
        if expected.shape != value.shape:
            found.append(f"{where}: {name} has the shape {value.shape}, the reference {expected.shape}")
            continue
        if not np.all(np.isfinite(expected)):
            found.append(f"{where}: {name} of the reference is not finite")
            continue
        if not np.all(np.isfinite(value)):
            row = np.argwhere(~np.isfinite(value))[0][0]
            found.append(f"{where}: {name} is not finite ({row_name(row)})")
            continue
        if expected.size == 0:
            continue
        scale = options.scale.get(name, float(np.max(np.abs(expected))))
        tolerance = options.column.get(name, options.tolerance)
        error = np.abs(value - expected)
        if not np.max(error) <= tolerance * scale:
            at = np.unravel_index(np.argmax(error), error.shape)
            share = f"{np.max(error) / scale:.2e} of its scale {scale:.3e}" if scale > 0 else "its scale is 0"
            found.append(
                f"{where}: {name} is {value[at]:.16g}, expected {expected[at]:.16g} ({row_name(at[0])}; off "
                f"by {share}, allowed {tolerance:.1e})"
            )
    return found


def compare_files(reference, result, options):
    """The differences between two files, as sentences."""
    for path in (reference, result):
        if not path.is_file():
            return [f"{path}: no such file"]
    where = str(result)
    try:
        if reference.suffix in (".hdf", ".h5"):
            ids, expected = sorted_fields(Particles(reference), reference)
            found_ids, value = sorted_fields(Particles(result), result)
            missing, extra = np.setdiff1d(ids, found_ids), np.setdiff1d(found_ids, ids)
            if missing.size or extra.size:
                example = ", ".join(str(i) for i in list(missing[:3]) + list(extra[:3]))
                return [f"{where}: {missing.size} particles missing, {extra.size} extra (ids {example})"]

            def row_name(row):
                return f"particle {ids[row]}"
        else:
            expected, value = History(reference), History(result)
            if expected.zones != value.zones:
                return [f"{where}: {value.zones} zones, the reference has {expected.zones}"]
            if expected.rows != value.rows:
                return [f"{where}: {value.rows} rows, the reference has {expected.rows}"]
            if expected.rows == 0:
                return [f"{where}: no rows to compare"]
            expected, value = expected.columns, value.columns

            def row_name(row):
                return f"row {row + 1}"
    except Unreadable as error:
        return [str(error)]
    return compare_columns(where, expected, value, options, row_name)


def compare(reference, result, options):
    """Files or directories."""
    if not reference.is_dir():
        return compare_files(reference, result, options), 1
    if not result.is_dir():
        return [f"{result}: no such directory"], 0
    names = {
        path.relative_to(top)
        for top in (reference, result)
        for path in top.rglob("*")
        if path.suffix in (".dat", ".hdf", ".h5")
    }
    if not names:
        return [f"{reference}: nothing to compare"], 0
    found = []
    for name in sorted(names):
        found += compare_files(reference / name, result / name, options)
    return found, len(names)


def named_value(text):
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text}: expected NAME=NUMBER")


def main(arguments=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("reference", type=Path)
    parser.add_argument("result", type=Path)
    parser.add_argument("--tolerance", type=float, default=1e-12)
    parser.add_argument("--column", type=named_value, action="append", default=[])
    parser.add_argument("--scale", type=named_value, action="append", default=[])
    parser.add_argument("--ignore", action="append", default=[])
    options = parser.parse_args(arguments)
    options.column, options.scale = dict(options.column), dict(options.scale)
    found, files = compare(options.reference, options.result, options)
    for difference in found:
        print(difference)
    if not found:
        print(f"{options.result}: the same as the reference" + (f" ({files} files)" if files > 1 else ""))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
