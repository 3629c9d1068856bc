#!/usr/bin/env python3
"""A page of all shipped scenes: each is run where it has no finished result yet, gets its report, and stands
on the page.

   gallery.py [options] [SCENE ...]     names of scenes of input/ (all without)

   --program PATH    the program (./gimp3d)
   --ranks N         it runs on (1)
   --limit SECONDS   a scene that its plan says takes longer is left out, unless it is named (300)
   --output DIR      where index.html goes (out/gallery)
   --scenes DIR      where the scenes are (input)

A result is taken where it has come to its end and has every value that the scene says; else the scene is run
again. Results are where the scenes say (out/...), as `mpirun -n N ./gimp3d < input/x.nml` puts them. Exit
status 1 where a scene could not be run, 2 where one is named that is not there."""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import quote

from . import report
from .report_page import badge, join, tag, whole
from .report_worth import compare, look
from .run_data import Unreadable, groups_in, read_namelists, text_in
from .run_log import log_of
from .scene_text import Scene

references = {
    "sphere": "sphere_hypo_h0.1.csv",
    "demo": "sphere_hypo_h0.1.csv",
    "hertz": "sphere_hypo_h0.1.csv",
    "cone_cylinder": "cone_hypo_h0.05.csv",
    "flat_cylinder": "flat_hypo_h0.05.csv",
    "cone": "E2_cone_hypo_h0.024.csv",
    "sphere_levels": "E3_sphere_hypo_h0.15.csv",
    "cone_levels": "E4_cone_hypo_h0.012.csv",
}


class Entry:
    """A scene on the page: its text, its directory, and what became of it."""

    def __init__(self, path):
        self.name, self.path = path.stem, path
        self.text = text_in(path)
        self.case = read_namelists(self.text)
        self.title = self.case["scene"][0].get("title", [self.name])[0]
        self.directory = Path(self.case["output"][0]["directory"][0]) if "output" in self.case else None
        self.left_out, self.failed = "", ""

    @property
    def words(self):
        """The comment before the first group."""
        lines = [
            line.lstrip("! ").rstrip()
            for line in self.text[: groups_in(self.text)[0].first].splitlines()
            if line.startswith("!")
        ]
        return " ".join(lines)

    def has_result(self):
        """Whether a run of this scene, as it stands, has come to its end."""
        case, log = self.directory / "case.nml", self.directory / "run.log"
        if not (case.is_file() and log.is_file()) or log_of(self.directory).state != "finished":
            return False
        try:
            ran = read_namelists(case)
        except Unreadable:
            return False
        return all(
            len(ran.get(group, [])) == len(ones)
            and all(
                same(values, there.get(name))
                for one, there in zip(ones, ran[group])
                for name, values in one.items()
            )
            for group, ones in self.case.items()
        )


def same(values, ran):
    """Whether a variable was what the scene says; choices may be in capitals."""
    return (
        ran is not None
        and len(values) == len(ran)
        and all(
            (
                math.isclose(a, b, rel_tol=1e-12)
                if isinstance(a, float) and isinstance(b, float)
                else str(a).lower() == str(b).lower()
            )
            for a, b in zip(values, ran)
        )
    )


def call(options, text, *arguments):
    """Run the program on a scene's text."""
    return subprocess.run(
        ["mpirun", "-n", str(options.ranks), options.program, *arguments],
        input=text,
        capture_output=True,
        text=True,
    )


def planned(options, entry):
    """Seconds that the plan of a scene says; 0 for one whose first steps fail already, None for one that is
    not taken."""
    scene = Scene(entry.text)
    scene.set("scene", "mode", "plan")
    with tempfile.TemporaryDirectory() as directory:
        plan = Path(directory) / "plan.json"
        done = call(options, scene.text, "--json", str(plan))
        if done.returncode == 0:
            return json.loads(plan.read_text())["time_s"]
    if done.returncode == 3:
        return 0.0
    entry.failed = sentence(done)
    return None


def sentence(done):
    """What the program said on standard error."""
    said = [line for line in done.stderr.splitlines() if line.startswith("gimp3d: ")]
    return said[0] if said else f"exit status {done.returncode}"


def settle(options, entry, named):
    """See that a scene has a result, or why it has none."""
    if entry.directory is None:
        entry.left_out = "it writes nothing, for it has no &output"
        return
    if entry.has_result():
        print(f"{entry.name}: has its result in {entry.directory}", flush=True)
        return
    seconds = planned(options, entry)
    if seconds is None:
        return
    if seconds > options.limit and not named:
        entry.left_out = (
            f"its plan says {seconds:.3g} s on {options.ranks} rank(s), above the limit of "
            f"{options.limit:g} s"
        )
        print(f"{entry.name}: left out, for {entry.left_out}", flush=True)
        return
    said = f"by its plan for {seconds:.2g} s" if seconds else "without a plan, for its first steps fail"
    print(f"{entry.name}: runs, {said}", flush=True)
    done = call(options, entry.text)
    if done.returncode:
        entry.failed = sentence(done)
        print(f"{entry.name}: {entry.failed}", file=sys.stderr)


def card(options, entry):
    """The entry on the page, with its report written."""
    given = report.parser().parse_args([str(entry.directory), "--program", options.program])
    reference = report.root / "test" / "references" / "fem" / references.get(entry.name, "-")
    if reference.is_file():
        given.finite_elements = [reference]
    page, made = report.build(entry.directory, given)
    report.write(entry.directory / "report.html", page)
    for problem in made.problems:
        print(f"warning: {entry.name}: {problem}", file=sys.stderr)
    words, kind = report.states[made.state]
    rows = [row for row in made.worth() if row.verdict != compare and row.matters]
    looks = sum(row.verdict == look for row in rows)
    alarms = len(made.log.alarms) if made.log else 0
    link = relative(entry.directory / "report.html", options.output)
    return tag(
        "article",
        tag("h2", tag("a", entry.title, href=link)),
        thumbnail(made),
        tag(
            "p",
            badge(words, kind),
            " ",
            badge(f"{len(rows) - looks} of {len(rows)} figures good", "good" if not looks else "look")
            if rows
            else "",
            " ",
            badge(f"{alarms} warning(s)", "look") if alarms else "",
        ),
        tag(
            "p",
            tag("code", f"{options.folder.name}/{entry.name}.nml"),
            f": {made.log.reached}, {made.log.ranks} rank(s)" if made.log else "",
        ),
        tag("p", entry.failed) if entry.failed else "",
        tag("p", entry.words, class_="quiet"),
        id=f"scene-{entry.name}",
    )


def thumbnail(made):
    """The picture of a run: its section, else its energies."""
    cut = [one for one in made.drawn if one.name.startswith("section-1")] or [
        one for one in made.drawn if one.name == "still-energy"
    ]
    return join(
        tag("img", src=one.uri, alt=one.alt, width=one.size[0], height=one.size[1]) for one in cut[-1:]
    )


def relative(path, start):
    """A link from a directory to a file."""
    return quote(os.path.relpath(path, start))


def missing(options, entry):
    why = f"could not be run: {entry.failed}" if entry.failed else f"was left out: {entry.left_out}"
    return tag(
        "article",
        tag("h2", entry.title),
        tag("p", badge("failed", "bad") if entry.failed else badge("left out", "info")),
        tag(
            "p",
            tag("code", f"{options.folder.name}/{entry.name}.nml"),
            f" {why}.",
            ""
            if entry.failed
            else join([" ", tag("code", f"make gallery SCENES={entry.name}"), " runs it."]),
        ),
        tag("p", entry.words, class_="quiet"),
        id=f"scene-{entry.name}",
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--program", default="./gimp3d")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0)
    parser.add_argument("--output", type=Path, default=Path("out/gallery"))
    parser.add_argument("--scenes", dest="folder", type=Path, default=report.root / "input")
    options = parser.parse_args()
    known = {path.stem: path for path in sorted(options.folder.glob("*.nml"))}
    unknown = [name for name in options.scenes if name not in known]
    if unknown:
        print(
            f"gallery: {unknown[0]}: no such scene in {options.folder}; there are {', '.join(known)}",
            file=sys.stderr,
        )
        return 2
    entries, cards = [Entry(path) for path in known.values()], []
    for entry in entries:
        named = entry.name in options.scenes
        if options.scenes and not named and not (entry.directory and entry.has_result()):
            entry.left_out = "it was not asked for, and has no result yet"
        else:
            settle(options, entry, named)
        there = not entry.left_out and (entry.directory / "case.nml").is_file()
        cards.append(card(options, entry) if there else missing(options, entry))
    shown = sum(not (entry.failed or entry.left_out) for entry in entries)
    body = join(
        [
            tag(
                "header",
                tag("h1", "gimp3d: the scenes that come with it"),
                tag(
                    "p",
                    f"{shown} of {len(entries)} scenes of {options.folder.name}/ with their results. Each "
                    "title leads to the report of its run.",
                    class_="quiet",
                ),
            ),
            tag("main", tag("div", *cards, class_="cards")),
            tag(
                "footer",
                tag(
                    "p",
                    "Made by gimp3d-post gallery. Pictures are in the page; reports stand beside the "
                    "results.",
                ),
            ),
        ],
        "\n",
    )
    options.output.mkdir(parents=True, exist_ok=True)
    report.write(options.output / "index.html", whole("gimp3d: scenes", body))
    print(options.output / "index.html")
    return 1 if any(entry.failed for entry in entries) else 0


if __name__ == "__main__":
    sys.exit(main())
