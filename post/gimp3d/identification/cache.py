"""Runs that are kept by the text of their scene, so that none is made twice."""

import hashlib
import json
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from . import forward

SHIPPED = tuple(Path(__file__).with_name(name) for name in ("cones.json", "spheres.json"))


def key_of(case):
    """The name of a case in the cache: a hash of its scene."""
    return hashlib.sha256(forward.scene_text(case).encode()).hexdigest()[:16]


class Cache:
    """A folder with a file for each run, and the runs that come with the package."""

    def __init__(self, folder, shipped=SHIPPED):
        self.folder = Path(folder)
        self.records = {}
        for path in shipped or ():
            if path.is_file():
                self.records.update(json.loads(path.read_text()))
        for path in sorted(self.folder.glob("*.json")):
            record = json.loads(path.read_text())
            if isinstance(record, dict) and "tip" in record:  # others are runs of the general form
                self.records[path.stem] = record

    def __contains__(self, case):
        return key_of(case) in self.records

    def __getitem__(self, case):
        return self.records[key_of(case)]

    def put(self, case, kept, seconds):
        record = {**case.record(), "seconds": round(seconds, 2), "kept": kept}
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f"{key_of(case)}.json"
        path.with_suffix(".part").write_text(json.dumps(record))
        path.with_suffix(".part").rename(path)
        self.records[path.stem] = record

    def write(self, path, tips):
        """The runs of some tips as one file, a line each: what comes with the package."""
        some = sorted(key for key, record in self.records.items() if forward.case_of(record).tip in tips)
        lines = [f'"{key}": {json.dumps(rounded(self.records[key]), separators=(",", ":"))}' for key in some]
        Path(path).write_text("{\n" + ",\n".join(lines) + "\n}\n")

    def cases(self):
        """All (Case, record)."""
        return [(forward.case_of(record), record) for record in self.records.values()]

    def run(self, cases, cores=None, program=None, progress=None):
        """Run what is missing, as many at once as there are cores, the longest first. Each is kept as soon as
        it has ended; RunFailed, when all have ended, where one fails."""
        from ..api import RunFailed
        from .planning import work

        missing = list({key_of(case): case for case in cases if case not in self}.values())
        missing.sort(key=work, reverse=True)

        def one(case):
            try:
                self.put(case, *self.made(case, program))
            except RunFailed as failure:
                return failure
            return None

        with ThreadPoolExecutor(cores or 1) as pool:
            for done, failure in enumerate(pool.map(one, missing), 1):
                if failure:
                    raise failure
                if progress:
                    progress(done, len(missing))

    @staticmethod
    def made(case, program):
        """What is kept of a run that is made now, and its seconds of the processor."""
        from ..launch import run

        with tempfile.TemporaryDirectory() as folder:
            begun = time.monotonic()
            result = run(forward.scene_text(case, f"{folder}/run"), program=program, progress=False)
            seconds = processor_seconds(result) or time.monotonic() - begun
            history = result.tool()
            load = np.abs(history["load_z"])
            return forward.reduced(history["depth"], load, history["time"], case), seconds


def rounded(record):
    """Its curves to five digits."""
    kept = {
        name: [float(f"{value:.5g}") for value in values] if isinstance(values, list) else values
        for name, values in record["kept"].items()
    }
    return {**record, "kept": kept}


def processor_seconds(run):
    """Of a run, as its cost.dat says; none where that does not say."""
    notes = run.history("cost").notes
    try:
        return float(notes["elapsed_s"]) * float(notes.get("processor_share", 1.0))
    except (KeyError, ValueError):
        return None
