#!/usr/bin/env python3
"""One page about a run, complete in itself: RUN/report.html.

   report.py [options] RUN

   --finite-elements FILE.csv   a reference curve beside the load (may be repeated)
   --no-theory                  without the half-space curve
   --snapshot FILE.hdf          another particle file for the pictures
   --program PATH               the program in the command that repeats the run (./gimp3d)

What a run did not write is said on the page. Exit status 2 where the directory holds no run.
"""

import argparse
import datetime
import hashlib
import os
import re
import shutil
import sys
import time
from pathlib import Path

import numpy as np

from . import plots
from . import report_answer
from . import report_charts
from . import report_pictures
from .report_hardness import hardness_sections
from .report_page import Markup, badge, embedded, image, join, section, si, table, tag, whole
from .report_worth import judge, look
from .run_data import (
    History,
    Particles,
    Unreadable,
    depth_of,
    particle_files,
    read_namelists,
    snapshot_paths,
    why,
)
from .run_log import RunLog

root = Path(__file__).resolve().parents[2]
lock_dead_after = 600  # s; src/io/output_lock.f90

states = {
    "finished": ("finished", "good"),
    "stopped": ("stopped, and can go on", "look"),
    "fault": ("stopped by a fault", "bad"),
    "open": ("no end: it goes on, or was killed", "look"),
    "none": ("no log", "bad"),
}


class NoRun(Exception):
    """A directory that holds nothing of a run; the text says so."""


class Report:
    """What is known of a run: what could be read, and `problems` for what could not."""

    def __init__(self, directory, options):
        self.directory, self.options = directory, options
        if not directory.is_dir():
            raise NoRun(f"{directory}: no such directory")
        wanted = ("case.nml", "run.log", "energy.dat", "cost.dat", "tool_*.dat", "probe_*.dat", "particles_*")
        if not any(any(directory.glob(pattern)) for pattern in wanted):
            raise NoRun(
                f"{directory}: there is no run in it, for it has neither case.nml nor run.log nor any result"
            )
        self.problems, self.missing, self.drawn = [], [], []  # the pictures that the page has
        self.run = plots.Run(directory, self.read("case.nml", read_namelists) or {})
        said = self.read("run.log", lambda path: path.read_text(errors="replace"))
        self.energy = self.read("energy.dat", History)
        self.cost = self.read("cost.dat", History)
        self.log = None if said is None else RunLog(said, self.notes)
        self.tools = {}
        for tool in self.run.tools:
            history = self.read(f"tool_{tool['name'][0]}.dat", History)
            if history is not None and history.rows:
                self.tools[tool["name"][0]] = (tool, history)
        self.probes = {
            probe["name"][0]: self.read(f"probe_{probe['name'][0]}.dat", History)
            for probe in self.run.case.get("probe", [])
        }
        self.particles, self.snapshot = None, None
        self.find_particles()
        self.state = self.log.state if self.log else "none"
        self.answers = {name: report_answer.hardness_of(self, name) for name in self.tools}

    def read(self, name, how):
        """A file of the run by a reader; None, and a word on the page, where it is not there or not what it
        should be."""
        path = self.directory / name
        if not path.is_file():
            self.missing.append(name)
            return None
        try:
            return how(path)
        except (Unreadable, OSError, ValueError) as error:
            self.problems.append(f"{name} cannot be read: {error}")
            return None

    def is_of_run(self, path):
        """Whether an analysis in the directory is not older than the run: an earlier run may have left it."""
        began = self.log and self.log.began
        return not began or path.stat().st_mtime >= began

    def find_particles(self):
        formats = self.run.case.get("output", [{}])[0].get("formats", ["hdf5"])
        try:
            mine = snapshot_paths(self.directory)
            self.snapshot = self.options.snapshot or (plots.at_largest_load(self.run, mine) if mine else None)
            if self.snapshot is None:
                tecplot = any(self.directory.glob("particles_*.dat"))
                self.missing.append(
                    "particles_<step>.hdf, which sections and surfaces are drawn from: "
                    + (
                        "the run wrote Tecplot snapshots only (formats='tecplot')"
                        if tecplot
                        else f"the scene has formats='{formats[0]}'"
                        if "hdf5" not in formats
                        else "the run wrote no snapshot"
                    )
                )
                return
            particles = Particles(self.snapshot)
            if particles.ids.size:
                self.particles = particles
            else:
                self.missing.append(f"particles: {self.snapshot.name} holds none")
            others = len(set(particle_files(self.directory)) - set(mine))
            if others:
                self.problems.append(
                    f"{others} particle files here are not in the run's index: they are of an earlier run, "
                    "and are not drawn"
                )
        except (Unreadable, OSError, KeyError, ValueError) as error:
            self.problems.append(f"particles cannot be read: {error}")

    def attempt(self, what, make):
        """What make gives; an empty list, and a word on the page, where what the run wrote lacks
        something."""
        try:
            return make()
        except (Unreadable, KeyError, IndexError, ValueError, StopIteration) as error:
            reason = (
                f"what the run wrote {why(error)}" if isinstance(error, (KeyError, IndexError)) else error
            )
            self.problems.append(f"{what} could not be made: {reason}")
            return []

    @property
    def title(self):
        known = self.run.case.get("scene", [{}])[0].get("title")
        return known[0] if known else self.log.title if self.log and self.log.title else self.directory.name

    @property
    def notes(self):
        return self.cost.notes if self.cost else {}

    def worth(self):
        return self.attempt(
            "the verdicts",
            lambda: judge(
                self.notes,
                self.energy,
                [one for _, one in self.tools.values()],
                next(iter(self.answers.values()), None),
            ),
        )


# ---- numbers in words
# ------------------------------------------------------------------------------------------------------------


def written(value):
    """As a scene has it."""
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, str):
        return f"'{value}'"
    plain = f"{value:.15g}"
    power = re.sub(r"\.?0*e\+?(-?)0*(?=\d)", r"e\1", f"{value:.14e}")
    return power if len(power) < len(plain) else plain.replace("e-0", "e-")


# ---- parts of the page
# ------------------------------------------------------------------------------------------------------------


def heading(report):
    words, kind = states[report.state]
    log = report.log
    sentence = tag("p", log.verdict) if log and log.verdict and report.state != "finished" else ""
    return tag(
        "header",
        tag("h1", report.title),
        tag("p", badge(words, kind), " ", tag("span", f"run in {report.directory}", class_="quiet")),
        sentence,
    )


def numbers(report):
    """Grid and time."""
    log, facts = report.log, []
    if log:
        for word in ("grid", "particles"):
            if log.said(word):
                facts.append((word, log.said(word).split(",")[0]))
    levels = depth_of(report.run.case)
    if levels:
        facts.append(("levels", f"{levels + 1}, the background grid among them"))
    if log and log.reached:
        facts.append(("simulated", log.reached))
    elif log and log.progress:
        facts.append(("reached", re.split(r" {3}", log.progress)[1].removeprefix("time ")))
    if "memory_B" in report.notes:
        facts.append(("memory", si(float(report.notes["memory_B"]), "B")))
    return section(
        "numbers",
        "Grid and time",
        tag("dl", *(tag("div", tag("dt", name), tag("dd", value)) for name, value in facts), class_="facts"),
    )


def warnings(report, rows):
    """What the run warned of, what is missing, and which figures want a look."""
    alarms = []
    log = report.log
    if report.state == "fault":
        alarms.append(("bad", f"The run ended with a fault: {log.verdict.removeprefix('stopped: ')}"))
    elif report.state == "stopped":
        alarms.append(("look", f"The run has not come to its end: {log.verdict}"))
    elif report.state == "open":
        lock = report.directory / "run.lock"
        alive = lock.is_file() and time.time() - lock.stat().st_mtime < lock_dead_after
        alarms.append(
            (
                "look",
                "The run has not come to its end: "
                + (
                    "its lock is fresh, so it is going on, or was killed less than ten minutes ago"
                    if alive
                    else "it was killed, for nothing says how it ended"
                )
                + (f". It said last: {log.progress}" if log.progress else ""),
            )
        )
    elif report.state == "none":
        alarms.append(("bad", "run.log is missing: nothing says how the run ended"))
    if log:
        alarms += [("bad" if line.startswith("WARNING") else "look", line) for line in log.alarms]
    for name, history in [
        ("energy.dat", report.energy),
        *((f"tool_{name}.dat", one) for name, (_, one) in report.tools.items()),
    ]:
        if history is not None and not all(
            np.all(np.isfinite(column)) for column in history.columns.values()
        ):
            alarms.append(("bad", f"{name} holds values that are not finite"))
    alarms += [("bad", problem) for problem in report.problems]
    alarms += [
        ("look", f"{row.quantity}: {row.value}; good is: {row.limit}. To do: {row.advice}.")
        for row in rows
        if row.verdict == look and row.matters
    ]
    alarms += [("info", f"Not there: {name}.") for name in report.missing]
    content = (
        tag("ul", *(tag("li", words, class_=kind) for kind, words in alarms), class_="alarms")
        if alarms
        else tag("p", "The run raised no warning, and no figure is out of its range.")
    )
    return section("warnings", "Warnings", content)


def described():
    """Unit and meaning of every variable, (group, name) -> (unit, meaning), from doc/user/input.md of the
    sources, of make install, or beside the program; empty where it is in none of them."""
    program = shutil.which("gimp3d")
    near = (
        [Path(program).resolve().parent, Path(program).resolve().parents[1] / "share/gimp3d"]
        if program
        else []
    )
    places = [one / "doc/user/input.md" for one in (root, *near)]
    path = next((one for one in places if one.is_file()), None)
    if path is None:
        return {}
    row = re.compile(r"\| *`(\w+)` *\| *`(\w+)` *\|[^|]*\|([^|]*)\|[^|]*\|[^|]*\|(.*)\|\s*$")
    found = {}
    for line in path.read_text().splitlines():
        match = row.match(line)
        if match:
            meaning = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", match[4]).replace("`", "").strip()
            found[match[1], match[2]] = (match[3].strip(), meaning)
    return found


def scene(report):
    if not report.run.case:
        return section(
            "scene",
            "What was simulated",
            tag("p", "case.nml, which has every value used, is not there or cannot be read."),
        )
    known = described()
    groups = []
    for group, ones in report.run.case.items():
        for number, one in enumerate(ones, 1):
            rows = []
            for name, values in one.items():
                unit, meaning = known.get((group, name), ("", ""))
                numbers = [value for value in values if isinstance(value, float)]
                value = tag(
                    "span",
                    f"{', '.join(map(written, values))}{' ' + unit if unit and numbers else ''}",
                    class_="value",
                )
                if numbers and unit in ("m", "s", "Pa", "N", "m/s") and any(numbers):
                    factor, scaled = plots.scaled(unit, numbers)
                    if factor != 1.0:
                        value = join(
                            [
                                value,
                                " ",
                                tag(
                                    "span",
                                    f"= {', '.join(f'{one / factor:.6g}' for one in numbers)} {scaled}",
                                    class_="quiet",
                                ),
                            ]
                        )
                rows.append((name, value, meaning))
            which = f"&{group}" + (f" {number} of {len(ones)}" if len(ones) > 1 else "")
            groups.append(
                tag(
                    "details",
                    tag("summary", f"{which}{' ' + repr(one['name'][0]) if 'name' in one else ''}"),
                    table(
                        f"{which}, all values used, defaults included",
                        ["variable", "value", ("meaning", "meaning")],
                        rows,
                    ),
                    open="",
                )
            )
    text_of = (report.directory / "case.nml").read_text(errors="replace")
    return section(
        "scene",
        "What was simulated",
        tag("div", *groups, class_="groups"),
        tag("details", tag("summary", "case.nml as it stands"), tag("pre", text_of)),
    )


def charts_and_stills(report):
    """The charts of tools, energies and probes, each with a picture for readers without scripts, and the
    sentences beside them."""
    specs, stills, words = [], {}, []
    for name, (tool, history) in report.tools.items():
        made = report.attempt(
            f"the load on the tool {name}",
            lambda: report_charts.tool(report.run, tool, history, report.options),
        )
        if made:
            if report.answers.get(name):
                report_answer.add_line(made[0], report.answers[name])
                report_answer.hide_theory(report.run.case, made[0])
            specs.append(made[0])
            words += made[1]
            if len(made[0]["axes"]) > 1 and made[0]["axes"][0]["name"] == "depth":
                still = report.attempt(
                    f"the load on the tool {name}",
                    lambda: [report_pictures.load_depth(report.run, tool, history, report.options)],
                )
                stills[made[0]["id"]] = still
                report.drawn += still
    if report.energy is not None and report.energy.rows:
        made = report.attempt("the energies", lambda: [report_charts.energies(report.energy)])
        specs += made
        if made:
            stills["chart-energy"] = report.attempt(
                "the energies", lambda: [report_pictures.energies(report.run, report.energy)]
            )
            report.drawn += stills["chart-energy"]
    probes = {
        name: history for name, history in report.probes.items() if history is not None and history.rows
    }
    if probes:
        specs += report.attempt("the probes", lambda: [report_charts.probes(probes)])
    for name, answer in report.answers.items():
        several = len(report.run.tools) > 1
        path = report.directory / (f"hardness_profile_{name}.csv" if several else "hardness_profile.csv")
        if answer and path.is_file() and report.is_of_run(path):
            specs += report.attempt(f"the profile of {name}", lambda: [report_charts.profile(path, name)])
    return specs, stills, words


def chart_figure(spec, stills):
    still = [tag("noscript", image(picture)) for picture in stills.get(spec["id"], [])]
    return tag("figure", *still, tag("figcaption", caption_of(spec)), class_="chart", id=spec["id"])


def histories(specs, stills, words):
    """The curves behind the first one, which stands on the first screen, and the profiles."""
    if not specs:
        return section("curves", "Curves", tag("p", "The run wrote no history that could be drawn."))
    figures = [chart_figure(spec, stills) for spec in specs[1:] if not is_profile(spec)]
    how = (
        "Point at a curve to read it. Drag a box to zoom in (a flat one zooms along one axis); double-click "
        "to see the whole; click a name to hide its curve."
    )
    return section(
        "curves",
        "Curves",
        tag("p", how, class_="quiet"),
        *(tag("p", sentence) for sentence in words),
        tag("div", *figures, class_="charts"),
    )


def is_profile(spec):
    return spec["id"].startswith("chart-profile")


def caption_of(spec):
    if spec["id"].startswith("chart-tool"):
        return (
            "Load along the tool's axis, from the tool's history; theory and references where there are any."
        )
    if spec["id"] == "chart-energy":
        return "Sums over the modelled part, from energy.dat."
    if is_profile(spec):
        return (
            "Means over rings about the tool's axis: height above the first surface, at the largest depth "
            "and when the load is gone; and the pressure under the tool at the largest depth."
        )
    return "Each probe follows the particle that was nearest to it at the start."


def pictures(report, profiles):
    """profiles: figures of the imprint's profile."""
    if report.particles is None:
        return section(
            "pictures",
            "Section and surface",
            tag(
                "p",
                "There are no particles to draw: "
                + "; ".join(word for word in report.missing + report.problems if word.startswith("particles"))
                + ".",
            ),
        )
    cut = report.attempt("the section", lambda: list(report_pictures.section(report.run, report.particles)))
    top = report.attempt(
        "the surface from above", lambda: list(report_pictures.surface(report.run, report.particles))
    )
    report.drawn += cut + top
    paths = report.attempt("the snapshots", lambda: snapshot_paths(report.directory))
    moving = []
    if len(paths) > 1 and cut:
        moving = report.attempt(
            "the section through the run",
            lambda: list(report_pictures.frames(report.run, paths, report.particles)),
        )
    return section(
        "pictures",
        "Section and surface",
        tag(
            "p",
            f"From {report.snapshot.name}"
            + (
                ", the snapshot nearest to the largest load"
                if report.tools and not report.options.snapshot
                else ""
            )
            + "; the modelled part of the bodies.",
            class_="quiet",
        ),
        *(tag("h3", words) for words in ["Section"] if cut),
        tag("div", *map(image, cut), class_="pictures"),
        *(tag("h3", words) for words in ["Through the run"] if moving),
        *([slider(moving, plots.Section(report.run, report.particles).place)] if moving else []),
        *(tag("h3", words) for words in ["Surface from above"] if top),
        tag("div", *map(image, top), class_="pictures"),
        *(tag("h3", words) for words in ["Profile of the imprint"] if profiles),
        tag("div", *profiles, class_="charts"),
    )


def slider(moving, first):
    """One picture of many; a script puts the slider there, else all are shown."""
    pictures = [
        tag(
            "img",
            src=one.uri,
            alt=one.alt,
            width=one.size[0],
            height=one.size[1],
            data_place=one.caption,
            data_start="yes" if one.caption == first else None,
        )
        for one in moving
    ]
    words = "Von Mises stress near the contact at each snapshot, in the colours of the largest load."
    return tag(
        "figure",
        tag("div", *pictures, class_="frames"),
        tag("output", ""),
        tag("figcaption", words),
        id="frames",
    )


def time_spent(report):
    if report.cost is None:
        return section(
            "time",
            "Where the time went",
            tag("p", "cost.dat is not there: it is written where a run ends by itself."),
        )
    cost, rows = report.cost, []
    share, names = (
        cost["share of elapsed time"],
        [cost.notes.get(f"phase_{n + 1}", str(n + 1)) for n in range(cost.rows)],
    )
    shown = sorted(
        (n for n in range(cost.rows) if share[n] > 0 and names[n] != "all"), key=lambda n: -share[n]
    )
    for n in shown:
        rows.append(
            (
                names[n],
                tag("span", class_="bar", style=f"width:{100 * share[n] / share[shown[0]]:.1f}%"),
                f"{share[n]:.1f} %",
                f"{cost['mean of the ranks'][n]:.3g} s",
                f"{cost['all ranks per particle-step'][n]:.3g} ns",
            )
        )
    elapsed, steps = float(cost.notes.get("elapsed_s", "nan")), float(cost.notes.get("particle_steps", "nan"))
    columns = [
        "phase",
        ("share", "bars"),
        ("of the time", "number"),
        ("mean of the ranks", "number"),
        ("a particle-step", "number meaning"),
    ]
    return section(
        "time",
        "Where the time went",
        tag(
            "p",
            f"{si(elapsed, 's')} on {cost.notes.get('ranks', '?')} rank(s), {steps:.3g} particle-steps: "
            f"{steps / elapsed:.3g} a second.",
        ),
        tag(
            "figure",
            table(
                "Wall-clock time by phase, since the program was last started; from cost.dat", columns, rows
            ),
            id="time-bars",
        ),
    )


def worth_section(rows):
    if not rows:
        return section(
            "worth",
            "What the accuracy is worth",
            tag(
                "p",
                "The run ended without the figures that its accuracy is judged by (closing summary, "
                "cost.dat).",
            ),
        )
    kinds = {"good": "good", look: "look", "compare": "info"}
    made = [
        (
            row.quantity,
            row.value,
            badge(row.verdict, kinds[row.verdict]),
            row.limit,
            "" if row.verdict == "good" else row.advice,
        )
        for row in rows
    ]
    return section(
        "worth",
        "What the accuracy is worth",
        table(
            "The run's own figures beside their limits (doc/user/output.md, How to judge a run). They say "
            "whether the equations "
            "were solved well on this grid; how far the grid is from the continuum, a second run on other "
            "cells says.",
            ["quantity", "value", "verdict", "good", "to do"],
            made,
            class_="stack",
        ),
    )


def repeat(report):
    log, case = report.log, report.directory / "case.nml"
    ranks = log.ranks if log else None
    rows = []
    if case.is_file():
        command = f"mpirun -n {ranks or 1} {report.options.program} < {case}"
        rows.append(
            (
                "command",
                join(
                    [
                        tag("code", command),
                        tag(
                            "p",
                            "It writes into the same directory: give case.nml another directory "
                            "in &output first to keep what is there.",
                            class_="quiet",
                        ),
                    ]
                ),
            )
        )
    rows.append(("ranks", ranks if ranks else "the run does not say"))
    program = log.said("program") if log else ""
    version, _, began = program.partition(", began ")
    rows.append(("program", version or "the run does not say: it is of a version that did not"))
    rows.append(("began", began or "the run does not say"))
    if log and log.starts > 1:
        rows.append(
            (
                "starts",
                f"{log.starts}: the run went on from checkpoints; the figures of its time are those of the "
                "last start",
            )
        )
    if case.is_file():
        rows.append(("case.nml, SHA-256", tag("code", hashlib.sha256(case.read_bytes()).hexdigest())))
    rows.append(
        (
            "this page",
            f"made {datetime.datetime.now().isoformat(sep=' ', timespec='seconds')} by gimp3d-post report",
        )
    )
    files = sorted(
        path
        for path in report.directory.iterdir()
        if path.is_file() and path.name != "report.html" and not path.name.startswith(".")
    )
    listing = table(
        "Files of the run",
        ["file", ("size", "number")],
        [(path.name, si(path.stat().st_size, "B")) for path in files],
    )
    said = (
        [tag("details", tag("summary", "run.log, the last start"), tag("pre", "\n".join(log.last)))]
        if log
        else []
    )
    return section(
        "repeat",
        "How to repeat it",
        table("What this run was", ["what", "value"], rows),
        tag("details", tag("summary", f"{len(files)} files"), listing),
        *said,
    )


def build(directory, options):
    """The page as text, and what is to be said of it on standard error."""
    report = Report(directory, options)
    rows = report.worth()
    specs, stills, words = charts_and_stills(report)
    parts = [
        report_answer.section_of(report, chart_figure(specs[0], stills) if specs else None),
        pictures(report, [chart_figure(spec, stills) for spec in specs if is_profile(spec)]),
        histories(specs, stills, words),
        *hardness_sections(report),
        worth_section(rows),
        numbers(report),
        time_spent(report),
        scene(report),
        repeat(report),
    ]
    parts.insert(2, warnings(report, rows))  # last made, for the others may have found what is missing
    parts = [part for part in parts if part]
    names = [re.match(r'<section id="(\w+)"><h2>(.*?)</h2>', part).groups() for part in parts]
    links = tag(
        "nav",
        tag("ul", *(tag("li", tag("a", Markup(name), href=f"#{anchor}")) for anchor, name in names)),
        aria_label="Parts of this page",
    )
    foot = tag(
        "footer",
        tag(
            "p",
            "Made by gimp3d-post report. The page holds all it shows and loads nothing. "
            "What the files mean: doc/user/output.md.",
        ),
    )
    body = join([heading(report), links, tag("main", *parts), foot, embedded({"charts": specs})], "\n")
    return whole(
        f"{report.title} - gimp3d", body, ["plotly-basic.min.js", "report.js"] if specs else []
    ), report


def write(path, page):
    """Written under another name and renamed: complete or not there."""
    partial = path.with_name(f".{path.name}.part")
    partial.write_text(page, encoding="utf-8")
    os.replace(partial, path)


def parser():
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("run", type=Path)
    made.add_argument("--finite-elements", type=Path, action="append", default=[])
    made.add_argument("--no-theory", action="store_true")
    made.add_argument("--snapshot", type=Path)
    made.add_argument("--program", default="./gimp3d")
    return made


def main():
    options = parser().parse_args()
    try:
        for path in options.finite_elements:
            plots.indentation.read_reference(path)
        page, report = build(options.run, options)
    except (NoRun, Unreadable) as error:
        print(f"report: {error}", file=sys.stderr)
        return 2
    try:
        write(options.run / "report.html", page)
    except OSError as error:
        print(f"report: {options.run / 'report.html'} cannot be written: {error.strerror}", file=sys.stderr)
        return 4
    for problem in report.problems:
        print(f"warning: {problem}", file=sys.stderr)
    print(options.run / "report.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
