"""Runs and scenes as objects: what `from gimp3d import Run, Scene` gives."""

import contextlib
import io
import json
import sys
from importlib import import_module
from pathlib import Path

from . import scene_text
from .run_data import History, Particles, Unreadable, read_namelists, snapshot_paths, text_in
from .run_log import log_of, numbers_of


class RunFailed(Exception):
    """The program or an analysis ended without a result: `status`, and the sentence that says why."""

    def __init__(self, status, sentence):
        super().__init__(sentence)
        self.status = status


class Scene(scene_text.Scene):
    """A scene: its text, which is read, changed and written.

    Scene("input/hertz.nml") reads a file, and so does Scene(Path); Scene(text) takes a text, which begins
    with & or a comment or has several lines. `set`, `add`, `remove` change groups in place, with comments and
    order kept; groups are counted from 0 among those of a name. Raises Unreadable where there is no such
    file, and where the text is no scene."""

    def __init__(self, source):
        is_text = isinstance(source, str) and (
            "\n" in source or source.lstrip("\ufeff \t").startswith(("&", "!"))
        )
        super().__init__(source if is_text else text_in(source))

    def __getitem__(self, group):
        """The groups of a name, each a dictionary of its variables; every variable is a list of values."""
        return read_namelists(self.text).get(group.lower(), [])

    def namelist(self):
        """The scene as f90nml has it, a dictionary of dictionaries (needs f90nml)."""
        import f90nml

        return f90nml.Parser().reads(self.text)

    def copy(self):
        return Scene(self.text)

    def write(self, path):
        """Write the text into a file (UTF-8); its path."""
        Path(path).write_text(self.text, encoding="utf-8")
        return Path(path)

    @property
    def directory(self):
        """Where a run of the scene writes; none if it writes nothing."""
        places = [output["directory"][0] for output in self["output"] if "directory" in output]
        return Path(places[0]) if places else None

    def __str__(self):
        return self.text


class Snapshot(Particles):
    """The particles of a run at one time: `snapshot["stress"]` is an array, one row a particle (symmetric
    tensors as xx yy zz yz xz xy), `units["stress"]` its unit, `time` in s, `ids`, `len(snapshot)`."""

    def __init__(self, path):
        import h5py

        super().__init__(path)
        with h5py.File(self.path, "r") as file:
            data = {"position": file["VTKHDF/Points"], **file["VTKHDF/PointData"]}
            unit = {name: table.attrs.get("unit", b"") for name, table in data.items()}
        self.units = {name: u.decode() if isinstance(u, bytes) else str(u) for name, u in unit.items()}

    def __len__(self):
        return len(self.ids)

    def frame(self):
        """A pandas data frame, a column a component, with the file's names of them (needs pandas)."""
        import pandas

        columns = {"id": self.ids}
        for name, data in self.fields.items():
            named = self.columns[name]
            columns.update(zip(named, data.reshape(len(self), len(named)).T))
        return pandas.DataFrame(columns)

    def mesh(self):
        """A PyVista mesh of points with all fields, symmetric tensors in VTK's order (needs pyvista)."""
        import pyvista

        return pyvista.read(self.path)


class Run:
    """A run by its directory: Run("out/cone").

    scene       the scene as it was run, every value in it
    log         its run.log (run_log.RunLog): verdict, state, alarms
    times       of the snapshots, s"""

    def __init__(self, directory):
        self.directory = Path(directory)
        if not (self.directory / "case.nml").is_file():
            raise Unreadable(f"{directory}: there is no case.nml, so this is no run")
        self.scene = Scene(self.directory / "case.nml")

    def __repr__(self):
        return f"Run({str(self.directory)!r})"

    @property
    def log(self):
        return log_of(self.directory)

    @property
    def finished(self):
        return self.log.state == "finished"

    @property
    def names(self):
        """Of the histories: energy, tool_<name>, probe_<name>, contact_<a>_<b>, atoms_<name>, and cost. Those
        that the scene has: an earlier run may have left others in the directory."""
        named = {
            f"{group}_{one.get('name', [group])[0]}"
            for group in ("tool", "probe", "atoms")
            for one in self.scene[group]
        }
        labels = {body.get("contact_group", [""])[0] or "rest" for body in self.scene["body"]}
        pairs = {f"contact_{a}_{b}" for a in labels for b in labels if a != b}
        own = {"energy", "cost", *named, *pairs}
        return sorted(path.stem for path in self.directory.glob("*.dat") if path.stem in own)

    @property
    def facts(self):
        """Figures of the run's end by name and unit (cost.dat): numbers where they are numbers."""
        facts = self.log.facts
        return {**facts, **numbers_of(facts)}

    def history(self, name):
        """A history by its name without .dat: columns as arrays, `units`, `frame()`."""
        return History(self.directory / f"{name}.dat")

    def tool(self, name=None):
        """The history of a tool, by default of the first one. Raises Unreadable where there is none."""
        return self.history(f"tool_{self.name_of_tool(name)}")

    def name_of_tool(self, name=None):
        """The name of a tool of the scene, by default of the first one. Raises Unreadable."""
        names = [tool["name"][0] for tool in self.scene["tool"]]
        if name is None and names:
            return names[0]
        if name not in names:
            there = f"its tools are {', '.join(names)}" if names else "it has none"
            asked = "there is no tool" if name is None else f"there is no tool {name!r}"
            raise Unreadable(f"{self.directory}: {asked}; {there}")
        return name

    @property
    def snapshots(self):
        """The particle files that the run's index particles.xdmf lists, in order. Raises Unreadable where the
        index, or a file that it lists, is not there."""
        return snapshot_paths(self.directory)

    @property
    def times(self):
        """Of the snapshots, s."""
        return [Particles(path).time for path in self.snapshots]

    def snapshot(self, number=-1):
        """A snapshot by its number, from 0; -1 is the last."""
        paths = self.snapshots
        if not -len(paths) <= number < len(paths):
            raise Unreadable(f"{self.directory}: there are {len(paths)} snapshots, and no number {number}")
        return Snapshot(paths[number])

    def load_depth(self, tool=None):
        """Depth from the first touch (m) and load (N) of the full body, as arrays, of a tool by its name, by
        default of the first one. Raises Unreadable where there is none."""
        from . import plots

        name = self.name_of_tool(tool)
        run = plots.Run(self.directory)
        chosen = next(one for one in run.tools if one["name"][0] == name)
        return plots.load_curve(run, chosen, self.tool(name))[:2]

    def hardness(self, **options):
        """What make hardness finds, a dictionary in SI units: hardness_oliver_pharr, hardness_true,
        modulus_..., each with <name>_uncertainty. Options as of `gimp3d-post hardness`: tool="tip",
        beta=1.034, window="20,98"."""
        name = options.get("tool")
        command("hardness", self.directory, no_plots=True, **options)
        several = len(self.scene["tool"]) > 1 and name
        path = self.directory / (f"hardness_{name}.json" if several else "hardness.json")
        return json.loads(path.read_text())

    def plots(self, **options):
        """Pictures of the run; the names of the files."""
        return [Path(line) for line in command("plots", self.directory, **options).split() if ".png" in line]

    def report(self, **options):
        """The page of the run; its name."""
        command("report", self.directory, **options)
        return self.directory / "report.html"


def command(name, *arguments, **options):
    """A subcommand of gimp3d-post within this process: what it prints. `options` are those of its command
    line, `no_plots=True` for --no-plots. RunFailed with its sentence where it ends with another status."""
    words = [*map(str, arguments), *words_of(options)]
    out, err, before = io.StringIO(), io.StringIO(), sys.argv
    sys.argv = [f"gimp3d-post {name}", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = import_module(f".{name}", __package__).main()
    except SystemExit as end:
        status = end.code
    finally:
        sys.argv = before
    if status:
        raise RunFailed(status, (err.getvalue() or out.getvalue()).strip() or f"{name}: status {status}")
    return out.getvalue()


def plots_of(directory, **options):
    """Run(directory).plots()"""
    return Run(directory).plots(**options)


def report_of(directory, **options):
    """Run(directory).report()"""
    return Run(directory).report(**options)


def words_of(options):
    """Options of a command line from keywords: no_plots=True is --no-plots."""
    words = []
    for option, value in options.items():
        if value is None or value is False:
            continue
        words.append("--" + option.replace("_", "-"))
        if value is not True:
            words.append(",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value))
    return words


def found_by(name, scene, options):
    """What study or solve finds, as a dictionary; what they print is not shown. RunFailed with the sentence
    where there is no answer."""
    if "program" not in options:
        from .launch import find_program

        options["program"] = find_program()
    module = import_module(f".{name}", __package__)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return module.find(module.arguments([str(scene), *words_of(options)]))
    except module.NoAnswer as reason:
        raise RunFailed(reason.status, str(reason)) from None


def study_of(scene, **options):
    """What the accuracy of a scene costs: study_of("input/hertz.nml", quantity="load", budget=300), options
    as of `gimp3d-post study`. A dictionary: `runs` (a dictionary a run: cell, core_seconds, error_percent,
    ...), `orders` by family, `front` (core_seconds and error_percent of the Pareto front), `shares`,
    `comparisons`, `answers` (sentences), `directory`."""
    return found_by("study", scene, options)


def solve_for(scene, error, **options):
    """The cheapest settings that have an error (%): solve_for("input/hertz.nml", error=1, quantity="load"),
    options as of `gimp3d-post solve`. A dictionary, that of answer.json: `settings`, `error` and
    `error_uncertainty` (%), `seconds`, `parts` of the error, `met`, `run` (directory), `chosen` (the scene)."""
    return found_by("solve", scene, {"error": error, **options})
