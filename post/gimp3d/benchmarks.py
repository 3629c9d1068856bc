#!/usr/bin/env python3
"""The book of benchmarks: runs what has not been run, measures, and writes the tables of
doc/user/benchmarks.md.

   benchmarks.py [options] [CASE ...]     cases (B1 B7) or rows of them (cone_100_0); all without

   --grids WORDS     coarse, fine, finer ("coarse fine finer", the default)
   --program PATH    the program (./gimp3d)
   --ranks N         it runs on (2)
   --no-run          measure and write only
   --document PATH   doc/user/benchmarks.md
   --list            the rows, and for each grid whether it has been run

Runs are kept in out/benchmarks/ROW_GRID and taken again while scene and program are the same. What was
measured stands in benchmarks.json beside the document: tables are written from it, so that some cases can be
run anew and the others stay. A row whose scene has changed since counts as not run. Exit status 1 where a run
ended early, 2 where a name is not known."""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from . import benchmark_cases
from . import benchmark_table
from .run_data import Unreadable
from .run_log import facts_of, log_of, numbers_of


class Trouble(Exception):
    """The user's mistake, or a scene that is refused; the text is a sentence."""


def digest(data):
    return hashlib.sha256(data if isinstance(data, bytes) else data.encode()).hexdigest()[:16]


def worked(directory):
    """Seconds that the processors worked for a run, all ranks together: on a machine that others use too,
    what is told of its price. 0 where its cost.dat does not say."""
    try:
        said = numbers_of(facts_of(directory / "cost.dat"))
    except OSError:
        return 0.0
    return said.get("processor_share", 0.0) * said["elapsed_s"] * said["ranks"]


class Book:
    """Rows, their runs and what was measured."""

    def __init__(self, options):
        self.options, self.cases = options, benchmark_cases.cases()
        self.rows = {row.name: row for case in self.cases for row in case.rows}
        self.program = digest(options.program.read_bytes()) if options.program.is_file() else None
        self.file = options.document.with_suffix(".json")
        self.measured, self.scenes = {}, {}
        if self.file.is_file():
            try:
                self.measured = json.loads(self.file.read_text())
            except ValueError as error:
                raise Trouble(f"{self.file}: not what this command wrote ({error})")

    def chosen(self):
        names = self.options.cases
        known = {case.name.lower(): case for case in self.cases}
        rows = []
        for name in names or [case.name for case in self.cases]:
            if name.lower() in known:
                rows += known[name.lower()].rows
            elif name in self.rows:
                rows.append(self.rows[name])
            else:
                raise Trouble(
                    f"{name}: no such case; there are {', '.join(c.name for c in self.cases)}, and rows of "
                    "--list"
                )
        return rows

    def ran(self, row, grid):
        """The record of a run whose scene and program are these; None where there is none."""
        file = Path(row.directory(grid)) / "benchmark.json"
        try:
            record = json.loads(file.read_text())
        except (OSError, ValueError):
            return None
        same = record["scene"] == digest(row.scene(grid)) and (
            self.options.no_run or record["program"] == self.program
        )
        return record if same else None

    def run(self, row, grid):
        """Run a row's scene on a grid."""
        directory = Path(row.directory(grid))
        shutil.rmtree(directory, ignore_errors=True)
        directory.mkdir(parents=True)
        text = row.scene(grid)
        (directory / "scene.nml").write_text(text)
        start = time.monotonic()
        done = subprocess.run(
            ["mpirun", "-n", str(self.options.ranks), str(self.options.program)],
            input=text,
            capture_output=True,
            text=True,
        )
        seconds = time.monotonic() - start
        said = [line for line in done.stderr.splitlines() if line.startswith("gimp3d: ")]
        fault = "" if done.returncode == 0 else said[0][8:] if said else f"exit status {done.returncode}"
        if done.returncode not in (0, 3):
            raise Trouble(f"{directory}/scene.nml: {fault}")
        log = log_of(directory)
        record = {
            "scene": digest(text),
            "program": self.program,
            "version": log.facts.get("program", ""),
            "ranks": self.options.ranks,
            "seconds": round(worked(directory) / self.options.ranks or seconds, 1),
            "particles": int(log.facts["particles_at_start"]) if "particles_at_start" in log.facts else None,
            "fault": fault,
            "end": log.verdict,
        }
        partial = directory / ".benchmark.json.part"
        partial.write_text(json.dumps(record, indent=1) + "\n")
        os.replace(partial, directory / "benchmark.json")
        return record

    def settle(self, row, grid):
        """See that a row has its numbers on a grid. True where all went well."""
        runs = [other for other in (*row.of, row) if other.make]
        record = None
        for one in runs:
            record = self.ran(one, grid)
            if record is None and not self.options.no_run:
                print(f"{one.key(grid)}: runs", flush=True)
                record = self.run(one, grid)
                print(f"{one.key(grid)}: {record['fault'] or 'done'}, {record['seconds']:.0f} s", flush=True)
            if record is None:
                return True
        entry = (
            {k: record[k] for k in ("version", "ranks", "seconds", "particles", "fault")} if record else {}
        )
        entry["scene"] = self.scene_of(row, grid)
        if not entry.get("fault"):
            directory = Path(runs[-1].directory(grid)) if runs else None
            try:
                entry["found"] = row.measure(directory, row.grids.get(grid))
            except Unreadable as error:
                entry["fault"] = str(error)
        self.measured[row.key(grid)] = entry
        self.save()
        return not entry.get("fault")

    def scene_of(self, row, grid):
        """What says whether a number that was measured is still that of the row."""
        if row.key(grid) not in self.scenes:
            self.scenes[row.key(grid)] = digest(
                "".join(one.scene(grid) for one in (*row.of, row) if one.make)
            )
        return self.scenes[row.key(grid)]

    def entry(self, row, grid):
        """What was measured of a row as it stands now."""
        entry = self.measured.get(row.key(grid))
        return entry if entry and entry["scene"] == self.scene_of(row, grid) else None

    def save(self):
        self.file.parent.mkdir(parents=True, exist_ok=True)
        partial = self.file.with_name(f".{self.file.name}.part")
        partial.write_text(json.dumps(dict(sorted(self.measured.items())), indent=1) + "\n")
        os.replace(partial, self.file)


def grids_of(row, wanted):
    """The grids of a row that are asked for; a row without a run has one, called `none`."""
    return [g for g in row.grids if g in wanted] if row.grids else ["none"]


def parser():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--grids", default="coarse fine finer")
    parser.add_argument("--program", type=Path, default=Path("./gimp3d"))
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--no-run", action="store_true")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--document", type=Path, default=Path("doc/user/benchmarks.md"))
    return parser


def main(arguments=None):
    options = parser().parse_args(arguments)
    wanted = options.grids.split()
    try:
        for grid in wanted:
            if grid not in ("coarse", "fine", "finer"):
                raise Trouble(f"--grids {grid}: allowed are coarse, fine and finer")
        book = Book(options)
        rows = book.chosen()
        if options.list:
            for row in rows:
                states = (
                    f"{grid} {'done' if book.entry(row, grid) else 'not run'}"
                    for grid in grids_of(row, wanted)
                )
                print(f"{row.case:<7} {row.name:<20} {row.what}: {', '.join(states)}")
            return 0
        if not options.no_run and book.program is None:
            raise Trouble(f"{options.program}: no such program; type make")
        text = options.document.read_text()
        benchmark_table.between(text)
        well = True
        for grid in ("coarse", "fine", "finer", "none"):
            for row in rows:
                if grid in grids_of(row, wanted):
                    well = book.settle(row, grid) and well
        partial = options.document.with_name(f".{options.document.name}.part")
        partial.write_text(benchmark_table.filled(options.document.read_text(), book))
        os.replace(partial, options.document)
        print(options.document)
        return 0 if well else 1
    except (Trouble, benchmark_table.NoPlace, OSError) as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
