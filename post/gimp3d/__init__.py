"""Scenes, runs and results of gimp3d in Python.

    from gimp3d import Run, Scene, run

    scene = Scene("input/indenter.nml")             # read, changed, written
    scene.set("material", "yield_stress", 3e8)
    result = run(scene, ranks=2)                    # started, with its progress shown
    print(result.hardness()["hardness_true"])       # Pa
    result.tool()["depth"], result.snapshot(-1)["stress"]

`Run("out/indenter")` is a run that is there already. All numbers are in SI units. The command gimp3d-post has
the same on the command line."""

from importlib import import_module

_places = {
    "Run": "api",
    "Scene": "api",
    "Snapshot": "api",
    "RunFailed": "api",
    "run": "launch",
    "run_many": "launch",
    "plots_of": "api",
    "report_of": "api",
    "solve_for": "api",
    "study_of": "api",
    "History": "run_data",
    "Particles": "run_data",
    "Unreadable": "run_data",
}
__all__ = sorted(_places)


def __getattr__(name):  # nothing is imported before it is asked for: ParaView's Python lacks some of it
    if name not in _places:
        raise AttributeError(f"module 'gimp3d' has no attribute {name!r}")
    value = getattr(import_module(f".{_places[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__():
    return __all__
