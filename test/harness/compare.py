#!/usr/bin/env python3
"""Compare what a run wrote with a reference.

   compare.py [options] REFERENCE RESULT

Both are histories (.dat, Tecplot ASCII, point packing), particle files (.h5, compared by particle id), or directories, in which
every .dat and .h5 of either must be in both. A value may differ by its tolerance times the column's scale, which is the largest
magnitude of the column in the reference (of the whole vector or tensor for particle fields). A NaN, an infinity, a missing or an
extra column, row, particle or file is a difference.

   --tolerance X           of every column that is not named (1e-12)
   --column NAME=X         of this column
   --scale NAME=X          take this scale, in the column's unit, instead of the reference's largest magnitude
   --ignore NAME           not compared (it may also be absent)

Names are given without their units. Exit status: 0 the same, 1 different, 2 wrong usage.
"""
import argparse
import re
import sys
from pathlib import Path

import numpy as np


class Different(Exception):
    """The two files cannot be compared value by value."""


def bare(name):
    """A column's name without its unit: 'load_z [N]' and 'load_z(N)' are load_z."""
    return re.sub(r"\s*[\[(].*$", "", name).strip()


def read_history(path):
    """Columns of a Tecplot ASCII history: name -> array, and how many zones it holds."""
    names, rows, zones = [], [], 0
    in_variables = False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        text = line.strip()
        upper = text.upper()
        if not text or text.startswith("#") or upper.startswith("TITLE"):
            in_variables = False
        elif upper.startswith("VARIABLES") or (in_variables and text.startswith('"')):
            in_variables = True
            names += [bare(name) for name in re.findall(r'"([^"]*)"', text)]
        elif upper.startswith("ZONE"):
            in_variables = False
            zones += 1
            if "DATAPACKING=BLOCK" in upper.replace(" ", ""):
                raise Different(f"{path}: block packing; compare the particles' .h5 files instead")
        else:
            in_variables = False
            try:
                row = [float(word) for word in text.split()]
            except ValueError:
                raise Different(f"{path}:{number}: not a row of numbers: {text[:60]}")
            if len(row) != len(names):
                raise Different(f"{path}:{number}: {len(row)} values for {len(names)} columns")
            rows.append(row)
    if not names:
        raise Different(f"{path}: no VARIABLES line")
    if len(set(names)) != len(names):
        raise Different(f"{path}: a column's name stands twice")
    values = np.array(rows, dtype=float).reshape(len(rows), len(names))
    return {name: values[:, i] for i, name in enumerate(names)}, zones


def read_particles(path):
    """Fields of a particle file in the order of the particles' ids: name -> array."""
    import h5py

    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise Different(f"{path}: {error}")
    with file:
        if "VTKHDF" not in file or "PointData" not in file["VTKHDF"]:
            raise Different(f"{path}: no VTKHDF/PointData")
        group = file["VTKHDF"]
        fields = {"position": group["Points"][...]}
        for name, data in group["PointData"].items():
            fields[name] = data[...]
        if "id" not in fields:
            raise Different(f"{path}: particles without ids")
        ids = fields.pop("id").reshape(-1)
        for name, data in fields.items():
            if data.shape[0] != ids.size:
                raise Different(f"{path}: {name} has {data.shape[0]} rows for {ids.size} particles")
        if np.unique(ids).size != ids.size:
            raise Different(f"{path}: an id stands twice")
        order = np.argsort(ids)
        fields = {name: data[order].astype(float) for name, data in fields.items()}
        time = time_of(group)
        if time is not None:
            fields["time"] = np.full(1, time)
        return ids[order], fields


def time_of(group):
    """Physical time of a particle file: an attribute, or the field-data or Steps convention of VTKHDF."""
    for holder in (group, group.file):
        for name in ("time", "Time", "TimeValue"):
            if name in holder.attrs:
                return float(np.ravel(holder.attrs[name])[0])
    for name in ("FieldData/TimeValue", "FieldData/time", "Steps/Values"):
        if name in group:
            return float(np.ravel(group[name][...])[0])
    return None


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
        if np.max(error) > tolerance * scale:
            at = np.unravel_index(np.argmax(error), error.shape)
            share = f"{np.max(error) / scale:.2e} of its scale {scale:.3e}" if scale > 0 else "its scale is 0"
            found.append(f"{where}: {name} is {value[at]:.16g}, expected {expected[at]:.16g} ({row_name(at[0])}; off by "
                         f"{share}, allowed {tolerance:.1e})")
    return found


def compare_files(reference, result, options):
    """The differences between two files, as sentences."""
    for path in (reference, result):
        if not path.is_file():
            return [f"{path}: no such file"]
    where = str(result)
    try:
        if reference.suffix == ".h5":
            ids, expected = read_particles(reference)
            found_ids, value = read_particles(result)
            missing, extra = np.setdiff1d(ids, found_ids), np.setdiff1d(found_ids, ids)
            if missing.size or extra.size:
                example = ", ".join(str(i) for i in list(missing[:3]) + list(extra[:3]))
                return [f"{where}: {missing.size} particles missing, {extra.size} extra (ids {example})"]

            def row_name(row):
                return f"particle {ids[row]}"
        else:
            expected, zones = read_history(reference)
            value, found_zones = read_history(result)
            if zones != found_zones:
                return [f"{where}: {found_zones} zones, the reference has {zones}"]
            rows, found_rows = (len(next(iter(columns.values()))) for columns in (expected, value))
            if rows != found_rows:
                return [f"{where}: {found_rows} rows, the reference has {rows}"]
            if rows == 0:
                return [f"{where}: no rows to compare"]

            def row_name(row):
                return f"row {row + 1}"
    except Different as difference:
        return [str(difference)]
    return compare_columns(where, expected, value, options, row_name)


def compare(reference, result, options):
    """Files or directories."""
    if not reference.is_dir():
        return compare_files(reference, result, options), 1
    if not result.is_dir():
        return [f"{result}: no such directory"], 0
    names = {path.relative_to(top) for top in (reference, result) for path in top.rglob("*")
             if path.suffix in (".dat", ".h5")}
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
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
