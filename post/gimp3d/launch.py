"""Runs started from Python: one with its progress, or many at once over the cores."""

import os
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .api import Run, RunFailed, Scene


def is_program(path):
    return os.access(path, os.X_OK) and Path(path).is_file()


def find_program(program=None):
    """The path of the program: as given, by the environment's GIMP3D, on the PATH, or built in this folder or
    in that of the package's sources. Raises RunFailed (127) where there is none, and where the one that is
    given, or that GIMP3D names, is not there: no other one is run in its place."""
    for given, what in ((program, "program="), (os.environ.get("GIMP3D"), "GIMP3D=")):
        if given:
            found = given if is_program(given) else shutil.which(given)
            if not found:
                raise RunFailed(127, f"{what}{given}: there is no such program")
            return str(Path(found).resolve())
    built = (Path("gimp3d"), Path(__file__).resolve().parents[2] / "gimp3d")
    for found in (shutil.which("gimp3d"), *built):
        if found and is_program(found):
            return str(Path(found).resolve())
    raise RunFailed(
        127, "there is no program gimp3d: build it with make, or say program= or the environment's GIMP3D"
    )


def check_ranks(ranks):
    """Raises RunFailed (2) where a number of ranks is none."""
    if ranks < 1 or ranks != int(ranks):
        raise RunFailed(2, f"ranks={ranks}; allowed: whole numbers from 1 on")


def run(scene, ranks=1, program=None, progress=True, directory=None, environment=None):
    """Run a scene to its end: the Run. `scene` is a Scene, a text or a file; `directory` is where it writes
    instead of what its &output says; `program` is the path of the program (find_program); progress=True shows
    the last line of the run's console. RunFailed, with the program's sentence, if it ends with a status that
    is not 0, and where there is no such program."""
    scene = scene.copy() if isinstance(scene, Scene) else Scene(scene)
    check_ranks(ranks)
    if directory is not None:
        scene.ensure("output")
        scene.set("output", "directory", str(directory))
    where = scene.directory
    if where is None:
        raise RunFailed(2, "the scene has no &output with a directory: there would be nothing to read")
    command = [find_program(program)]
    surroundings = {**os.environ, **(environment or {})}
    if ranks > 1:
        command = ["mpirun", "--bind-to", "none", "-n", str(ranks), *command]
        if hasattr(os, "geteuid") and os.geteuid() == 0:  # containers
            surroundings.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=surroundings,
    )
    said = []
    reader = threading.Thread(target=lambda: said.append(process.stderr.read()))
    reader.start()
    try:
        try:
            process.stdin.write(scene.text)
            process.stdin.close()
        except BrokenPipeError:  # it has refused the scene already
            pass
        for line in process.stdout:
            if progress and line.startswith("step "):
                print("\r" + line.rstrip()[:110].ljust(110), end="", file=sys.stderr, flush=True)
        status = process.wait()
    except BaseException:
        process.terminate()
        process.wait()
        raise
    finally:
        reader.join()
    if progress:
        print("\r" + " " * 110 + "\r", end="", file=sys.stderr)
    if status:
        lines = [line for line in said[0].splitlines() if line.startswith("gimp3d: ")]
        sentence = "\n".join(lines) or said[0].strip()[-500:]
        raise RunFailed(status, sentence or f"ended with status {status}")
    return Run(where)


def run_many(scenes, ranks=1, cores=None, **options):
    """Many scenes at once, as many as the cores hold: their Runs in the same order, or RunFailed where one
    has failed (the others are run to their ends). Each must write into a directory of its own."""
    check_ranks(ranks)
    scenes = [scene if isinstance(scene, Scene) else Scene(scene) for scene in scenes]
    places = [str(scene.directory) for scene in scenes]
    if len(set(places)) < len(places):
        raise RunFailed(2, "two of the scenes write into the same directory")
    at_once = max(1, (cores or len(os.sched_getaffinity(0))) // ranks)

    def one(scene):
        try:
            return run(scene, ranks=ranks, progress=False, **options)
        except RunFailed as failure:
            return failure

    with ThreadPoolExecutor(at_once) as pool:
        return list(pool.map(one, scenes))
