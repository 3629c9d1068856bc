"""The general form: any scenes with @name@ in them, and any column of their histories, against measured
columns.

   SCENE=hold.nml DATA=hold.csv COLUMNS=tool_tip.time:time,tool_tip.depth:depth
   PARAMETERS=creep_exponent=2:8,creep_rate=1e-5:1e-2

The first pair of COLUMNS is what the others are compared over. `@hardening@` stands for the table of LAW
(power, ludwik, voce) of the parameters that this law has. Several SCENE, each with its DATA and COLUMNS, are
one fit.

A round runs the scenes at a centre and at one step to both sides of it along each parameter, and fits a
parabola along each to every measured row; least squares on these gives the next centre, and steps shrink. So
the number of runs is known before the first. Steps are in logarithms where a range is above 0. What CHECK
changes (finer cells, slower tools, shorter steps) is run at the optimum, and what it does to the parameters
is a part of their uncertainty."""

import hashlib
import json
import os
import re
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from ..api import RunFailed, Scene
from ..launch import run_many
from ..oliver_pharr import correlation_time
from ..run_data import Unreadable, read_namelists, text_in
from . import measured
from .laws import LAWS, table
from .table_text import UNITS, in_si

SHRINK = 0.4  # of the steps, from round to round
FIRST = 0.25  # step of the first round, of the range
ROUNDS = 3
TRUST = 1.6  # steps that a round may go
DENSE = 5
FEW = 5  # rows beyond the parameters: fewer do not say their own noise
UNDETERMINED = 0.25  # one sigma of a logarithm


@dataclass
class Parameter:
    """A number of the scenes: its range, and where it begins."""

    name: str
    low: float
    high: float
    start: float

    @property
    def logarithmic(self):
        return self.low > 0

    def inner(self, value):
        return np.log(value) if self.logarithmic else value

    def outer(self, x):
        return np.exp(x) if self.logarithmic else x

    @property
    def span(self):
        return self.inner(self.high) - self.inner(self.low)


@dataclass
class Experiment:
    """A scene and what was measured: rows of `over` (the first column) and of the others, each with one
    sigma."""

    text: str
    name: str
    history: list  # (history, column), the first is `over`
    over: np.ndarray
    values: list
    sigmas: list = field(default_factory=list)
    titles: list = field(default_factory=list)


def read_parameters(words):
    """Parameters of `name=low:high` or `name=low:start:high`, separated by commas."""
    found = []
    for word in filter(None, words.split(",")):
        name, _, numbers = word.partition("=")
        try:
            values = [float(number) for number in numbers.split(":")]
        except ValueError:
            values = []
        if len(values) not in (2, 3) or not values[0] < values[-1]:
            raise Unreadable(f"PARAMETERS={word}: not NAME=LOW:HIGH or NAME=LOW:START:HIGH")
        low, high = values[0], values[-1]
        middle = np.sqrt(low * high) if low > 0 else 0.5 * (low + high)
        found.append(Parameter(name.strip(), low, high, values[1] if len(values) == 3 else float(middle)))
    if not found:
        raise Unreadable("PARAMETERS: no NAME=LOW:HIGH")
    return found


def filled(text, values, law="power"):
    """A scene's text with its placeholders filled in."""
    if "@hardening@" in text:
        function, names = LAWS[law]
        missing = [name for name in names if name not in values]
        if missing:
            raise Unreadable(
                f"@hardening@ of LAW={law} needs {', '.join(missing)} among the PARAMETERS or FIX"
            )
        given = [values[name] for name in names]
        strain, stress = table(lambda e: function(*given, e), 0.05 * given[1] / given[0])
        listed = lambda numbers: ",".join(f"{number:.7g}" for number in numbers)
        text = text.replace(
            "@hardening@",
            f"hardening_strain={listed(strain)},\n hardening_stress={listed(np.maximum.accumulate(stress))}",
        )
    for name, value in values.items():
        text = text.replace(f"@{name}@", f"{value:.9g}")
    left = re.search(r"@(\w+)@", re.sub(r"!.*", "", text))  # comments may name them
    if left:
        raise Unreadable(f"the scene has @{left[1]}@, which is neither in PARAMETERS nor in FIX")
    return text


def read_experiment(scene, data, columns, noise):
    """An Experiment; COLUMNS are pairs history.column:measured column."""
    names, units, rows = measured.read_table(Path(data))
    pairs = [word.split(":") for word in columns.split(",")]
    if len(pairs) < 2 or any(len(pair) != 2 or "." not in pair[0] for pair in pairs):
        raise Unreadable(f"COLUMNS={columns}: not HISTORY.COLUMN:MEASURED,... with two pairs at least")
    found = []
    for _, name in pairs:
        if name.lower() not in names:
            raise Unreadable(f"{data}: there is no column {name}; it has {', '.join(names)}")
        if names.count(name.lower()) > 1:
            raise Unreadable(f"{data}: there are several columns {name}; keep one, or rename the others")
        number = names.index(name.lower())
        kinds = [kind for kind in UNITS if kind != "ratio" or name.lower() not in measured.NAMES]
        found.append(in_si(data, name, units[number], rows[:, number], kinds))
        if not np.all(np.isfinite(found[-1])):
            raise Unreadable(f"{data}: column {name}: a value is not a finite number")
    experiment = Experiment(
        text_in(Path(scene)),
        Path(scene).stem,
        [tuple(pair[0].split(".", 1)) for pair in pairs],
        found[0],
        found[1:],
    )
    experiment.titles = [pair[1] for pair in pairs]
    experiment.sigmas = [(noise or 0.01) * float(np.max(np.abs(value))) for value in experiment.values]
    return experiment


class Model:
    """Curves of the experiments at values of the parameters, kept by their scenes."""

    def __init__(self, experiments, parameters, fixed, law, folder, cores, program):
        self.experiments, self.parameters, self.fixed, self.law = experiments, parameters, fixed, law
        self.folder, self.cores, self.program = Path(folder), cores, program
        self.seconds, self.runs = 0.0, 0

    def texts(self, x, changes=()):
        values = {p.name: float(p.outer(v)) for p, v in zip(self.parameters, x)} | self.fixed
        found = []
        for experiment in self.experiments:
            scene = Scene(filled(experiment.text, values, self.law))
            for group, which, variable, value in changes:
                scene.set(group, variable, value, which)
            scene.ensure("output")
            scene.set("output", "directory", "run")
            found.append(scene.text)
        return found

    def path(self, experiment, text):
        asked = repr((text, experiment.history, [float(v) for v in experiment.over]))
        return self.folder / f"{hashlib.sha256(asked.encode()).hexdigest()[:16]}.json"

    def curves(self, points, changes=()):
        """At each point: the rows of all experiments, one after the other. Missing ones are run, as many at
        once as there are cores."""
        wanted = [(e, t) for x in points for e, t in zip(self.experiments, self.texts(x, changes))]
        missing = {self.path(e, t): (e, t) for e, t in wanted if not self.path(e, t).is_file()}
        self.folder.mkdir(parents=True, exist_ok=True)
        scenes = []
        for path, (_, text) in missing.items():
            scene = Scene(text).copy()
            scene.set("output", "directory", str(path.with_suffix("")))
            scenes.append(scene)
        begun = time.monotonic()
        runs = run_many(scenes, cores=self.cores, program=self.program)
        self.seconds += time.monotonic() - begun
        self.runs += len(runs)
        for (path, (experiment, _)), run in zip(missing.items(), runs):
            if isinstance(run, RunFailed):
                raise run
            rows = [list(map(float, row)) for row in self.rows_of(run, experiment)]
            path.write_text(json.dumps(rows))
        size = len(self.experiments)
        rows = [np.concatenate([np.ravel(json.loads(self.path(e, t).read_text()))]) for e, t in wanted]
        return [np.concatenate(rows[n * size : (n + 1) * size]) for n in range(len(points))]

    @staticmethod
    def rows_of(run, experiment):
        """Each column at the measured places."""
        (first, over), *others = experiment.history
        x = np.asarray(run.history(first)[over])
        inside = experiment.over <= x.max() * (1 + 1e-6)
        if not np.all(inside):
            raise Unreadable(
                f"{experiment.name}: {over} is measured to {experiment.over.max():.4g}, but the run ends at "
                f"{x.max():.4g}"
            )
        order = np.argsort(x, kind="stable")
        for name, column in others:
            history = run.history(name)
            if column not in history.columns:
                raise Unreadable(f"{name}.dat has no column {column}; it has {', '.join(history.columns)}")
            yield at_places(experiment.over, x[order], np.abs(np.asarray(history[column]))[order])


def at_places(places, x, y):
    """A history at the measured places: where it has DENSE rows or more from half-way to one neighbour to
    half-way to the other, their mean about the place, as waves and cells ripple a load; else between rows."""
    found = np.interp(places, x, y)
    if len(places) < 3:
        return found
    order = np.argsort(places)
    half = np.gradient(places[order]) / 2
    for number, middle, reach in zip(order, places[order], half):
        low, high = np.searchsorted(x, [middle - reach, middle + reach])
        if high - low >= DENSE and middle - reach >= x[0] and middle + reach <= x[-1]:
            slope, mean = np.polyfit(x[low:high] - middle, y[low:high], 1)
            found[number] = mean
    return found


def parabolas(centre, before, behind):
    """Slope and curvature of every row along each parameter, a step being 1."""
    slope = np.stack([0.5 * (b - a) for a, b in zip(before, behind)], axis=-1)
    bend = np.stack([a + b - 2 * centre for a, b in zip(before, behind)], axis=-1)
    return slope, bend


@dataclass
class Found:
    """centre: the optimum (inner values), covariance of it by the data and by what CHECK changes; the fitted
    rows."""

    x: np.ndarray
    covariance: np.ndarray
    model: np.ndarray
    fitted: np.ndarray
    jacobian: np.ndarray  # whitened
    slope: np.ndarray  # of the rows over the inner values
    chi2: float
    rows: int


def fit(model, rounds=ROUNDS, changes=(), say=print):
    """The rounds."""
    parameters, experiments = model.parameters, model.experiments
    values = np.concatenate([np.ravel(e.values) for e in experiments])
    sigma = np.concatenate([np.repeat(s, len(e.over)) for e in experiments for s in e.sigmas])
    low = np.array([p.inner(p.low) for p in parameters])
    high = np.array([p.inner(p.high) for p in parameters])
    x = np.array([p.inner(p.start) for p in parameters], dtype=float)
    step = FIRST * (high - low)
    for number in range(rounds):
        x = np.clip(x, low + step, high - step) if number < rounds - 1 else np.clip(x, low, high)
        points = [x]
        for k in range(len(x)):
            points += [x - step * (np.arange(len(x)) == k), x + step * (np.arange(len(x)) == k)]
        curves = model.curves(points)
        slope, bend = parabolas(curves[0], curves[1::2], curves[2::2])
        rows = lambda u: curves[0] + slope @ u + 0.5 * bend @ u**2
        bounds = (np.maximum(-TRUST, (low - x) / step - 1e-9), np.minimum(TRUST, (high - x) / step + 1e-9))
        found = least_squares(lambda u: (rows(u) - values) / sigma, np.zeros(len(x)), bounds=bounds)
        left = found.fun
        chi2 = 2 * found.cost
        x = x + step * found.x
        shown = ", ".join(f"{p.name} {p.outer(v):.4g}" for p, v in zip(parameters, x))
        say(f"round {number + 1} of {rounds}: {shown}; chi2 {chi2:.4g} of {len(values)} rows", flush=True)
        last = step.copy()
        step = step * SHRINK
    fitted, freedom = rows(found.x), len(values) - len(x)
    scatter = chi2 / freedom * correlation_time(left) if freedom >= FEW else 1.0  # of few rows NOISE counts
    scatter = max(scatter, 1e-12)
    slope = (slope + bend * found.x) / last
    jacobian = slope / sigma[:, None] / np.sqrt(scatter)
    scale = np.sqrt((jacobian**2).sum(axis=0)) + 1e-300
    covariance = np.linalg.pinv((jacobian / scale).T @ (jacobian / scale), rcond=1e-13) / np.outer(
        scale, scale
    )
    shift = np.zeros(len(x))
    if changes:
        plain, changed = model.curves([x])[0], model.curves([x], changes)[0]
        shift = covariance @ jacobian.T @ ((changed - plain) / sigma / np.sqrt(scatter))
    return Found(x, covariance, np.outer(shift, shift), fitted, jacobian, slope, chi2, len(values))


def read_changes(words):
    """group.variable=value,... of CHECK, with a number for one of several groups (level.2.upper=...); values
    with blanks between them are lists."""
    found = []
    for word in filter(None, (words or "").split(",")):
        place, _, value = word.partition("=")
        group, *number, variable = place.split(".") if "." in place else (place, "")
        try:
            numbers = [float(text) for text in value.split()]
            which = int(number[0]) - 1 if number else None
        except ValueError:
            numbers = []
        if not variable or not numbers or len(number) > 1:
            raise Unreadable(f"CHECK={word}: not GROUP.VARIABLE=VALUE or GROUP.NUMBER.VARIABLE=VALUE")
        found.append((group, which, variable, numbers if len(numbers) > 1 else numbers[0]))
    return found


def sentences(model, found):
    """Values with intervals, and combinations that the data do not determine."""
    said = []
    whole = found.covariance + found.model
    for k, parameter in enumerate(model.parameters):
        sigma = 1.645 * np.sqrt(whole[k, k])
        low, middle, high = (parameter.outer(found.x[k] + s) for s in (-sigma, 0, sigma))
        said.append(f"{parameter.name}: {middle:.4g}, 90 % interval {low:.4g} to {high:.4g}")
    for value, row in zip(*np.linalg.svd(found.jacobian, full_matrices=False)[1:]):
        units = np.array([1.0 if p.logarithmic else 1.0 / p.span for p in model.parameters])
        sigma = float(np.max(np.abs(row) * units)) / max(value, 1e-300)
        if sigma > UNDETERMINED:
            names = [p.name for p, weight in zip(model.parameters, row) if abs(weight) > 0.3]
            said.append(
                f"Combination that is not determined: {' with '.join(names)} (standard deviation "
                f"{100 * sigma:.2g} %)."
            )
    if not np.any(found.model):
        said.append(
            "The intervals do not include the error of the model: add CHECK=grid.cell_size=... (finer "
            "cells), or another numerical setting that affects the accuracy."
        )
    return said


def identify(job):
    """SCENE, DATA, COLUMNS, PARAMETERS of a Job: the record that is written."""
    from .planning import spent

    begun = time.monotonic()
    settings = job.settings
    for key in ("SCENE", "DATA", "COLUMNS", "PARAMETERS"):
        if key not in settings:
            raise Unreadable(f"the general form needs {key}=")
    scenes, files, columns = (settings[key].split(";") for key in ("SCENE", "DATA", "COLUMNS"))
    if not len(scenes) == len(files):
        raise Unreadable(
            f"{len(scenes)} SCENE and {len(files)} DATA: the numbers must be equal; separate them by ;"
        )
    columns = columns * len(scenes) if len(columns) == 1 else columns
    noise = job.number("NOISE", 0.0) / 100
    experiments = [read_experiment(*one, noise) for one in zip(scenes, files, columns)]
    fixed = {}
    for word in filter(None, settings.get("FIX", "").split(",")):
        name, _, value = word.partition("=")
        try:
            fixed[name] = float(value)
        except ValueError:
            raise Unreadable(f"FIX={word}: not NAME=VALUE")
    parameters = read_parameters(settings["PARAMETERS"])
    cores = int(job.number("CORES", 0)) or None
    folder = Path(settings.get("OUT", "out/identify"))
    model = Model(experiments, parameters, fixed, settings.get("LAW", "power"),
                  settings.get("CACHE", folder / "cache"), cores, settings.get("PROGRAM"))  # fmt: skip
    changes, rounds = read_changes(settings.get("CHECK")), int(job.number("ROUNDS", ROUNDS))
    price = plan(model, rounds, changes)
    if settings.get("PLAN") == "only":
        return {"minutes": price.minutes}
    before = spent()
    found = fit(model, rounds, changes)
    said = sentences(model, found)
    folder.mkdir(parents=True, exist_ok=True)
    whole = found.covariance + found.model
    record = {
        "parameters": {p.name: float(p.outer(v)) for p, v in zip(parameters, found.x)},
        "sigma": {p.name: float(np.sqrt(whole[k, k])) for k, p in enumerate(parameters)},
        "logarithmic": [p.name for p in parameters if p.logarithmic],
        "covariance_data": found.covariance.tolist(),
        "covariance_model": found.model.tolist(),
        "chi2": found.chi2,
        "rows": found.rows,
        "runs": model.runs,
        "seconds": round(time.monotonic() - begun, 1),
        "predicted_minutes": price.minutes,
        "predicted_processor_seconds": price.seconds,
        "processor_seconds": spent() - before,
        "sentences": said,
        "command": "gimp3d-post identify " + " ".join(job.words),
    }
    (folder / "answer.json").write_text(json.dumps(record, indent=1) + "\n")
    from .general_page import write

    write(folder / "identification.html", model, found, said, record["command"])
    print("\n".join(said))
    print(folder / "answer.json")
    print(folder / "identification.html")
    return record


def plan(model, rounds, changes):
    """Print and return the Price of all runs. Scenes with the values of CHECK are planned at once, so that an
    error is found before the first run."""
    from .planning import Price, forecast, seconds_of_scene, spent

    x = np.array([p.inner(p.start) for p in model.parameters], dtype=float)
    texts, changed = model.texts(x), model.texts(x, changes) if changes else []
    quasi_static = any("quasi_static" in read_namelists(text) for text in texts)
    share = 1.0
    if quasi_static:  # no forecast by the program: the first run is measured, and kept
        begun, had, before = time.monotonic(), spent(), model.runs
        model.curves([x])
        if model.runs > before:
            each = (spent() - had) / (model.runs - before)
            share = min((spent() - had) / max(time.monotonic() - begun, 1e-3), 1.0)
        else:
            each = 0.0
        size = lambda some: sum(forecast(text, model.program)["memory_particles_B"] for text in some)
        checked = each * len(texts) * size(changed) / size(texts)
    else:
        found = [seconds_of_scene(text, model.program) for text in texts]
        each = float(np.mean([seconds for seconds, _ in found]))
        share = float(np.mean([one for _, one in found]))
        checked = sum(seconds_of_scene(text, model.program)[0] for text in changed)
    count = rounds * (2 * len(x) + 1) * len(texts)
    count += 2 * len(texts) if changes else 0
    seconds = each * (count - len(changed)) + checked
    cores = min(model.cores or len(os.sched_getaffinity(0)), 2 * len(x) + 1)
    price = Price(seconds, seconds / share / cores / 60)
    print(
        f"Plan: {count} runs in {rounds} rounds, {each:.3g} s each: {price.words}"
        + (" (from the first run)" if quasi_static else ""),
        flush=True,
    )
    return price
