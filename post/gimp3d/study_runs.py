"""Runs of a study: each in a directory named by what goes into it, so that what was run stays."""

import hashlib
import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import time

from .run_data import Unreadable, depth_of
from .run_log import facts_of as notes_of
from .scene_text import BadSetting, Scene
from .study_scene import add_probes, scene_of

session = time.strftime("%Y-%m-%dT%H:%M:%S")


class Rejected(Exception):
    """The program does not take a scene (exit status 2): its own sentence."""


class NoSection(BadSetting):
    """A scene has no section: the program's own sentence."""


class Run:
    """One rung: its scene, its directory, and what its repeats took."""

    def __init__(self, study, settings):
        self.study = study
        self.settings = {**study.setting.base, **settings}
        scene = self.make_scene()
        self.case = scene.values()
        self.text = scene.text
        key = hashlib.sha256(
            f"{study.program_hash}\n{study.ranks}\n{json.dumps(self.case)}".encode()
        ).hexdigest()[:16]
        self.directory = study.directory / "runs" / key
        self.record = {"seconds": [], "sessions": [], "fault": ""}
        kept = self.directory / "study.json"
        if kept.is_file():
            try:
                self.record = json.loads(kept.read_text())
            except ValueError as error:
                raise Unreadable(
                    f"{kept}: not a record of a run ({error}); remove its directory and it is run again"
                )

    def make_scene(self):
        study = self.study
        settings = {name: value for name, value in self.settings.items() if name != "section"}
        scene = scene_of(study.text, settings, study.setting)
        if study.setting.program:
            return scene
        point = next((one.point for one in study.quantities.values() if one.point), None)
        if point:  # the same one of all quantities; other quantities may be of the scene's own probes
            add_probes(scene, point)
        scene.remove("output")
        scene.remove("checkpoint")
        # Without snapshots; the directory is the run's own
        scene.add("output", directory=".", formats="none")
        return self.section_of(scene) if self.settings.get("section") else scene

    share = 1.0  # of what a run has, that which the scene models

    def section_of(self, scene):
        """The scene given by its section, as the program says."""
        sides = scene.values()["grid"][0]["boundary"]
        self.share = 0.5 ** [sides[0].lower(), sides[2].lower()].count("symmetry")
        known = self.study.sections
        if scene.text not in known:
            done = subprocess.run(
                [*self.study.launch, "-n", "1", str(self.study.program), "--section"],
                input=scene.text,
                cwd=self.study.directory,
                capture_output=True,
                text=True,
            )
            known[scene.text] = done.stdout if done.returncode == 0 else NoSection(last_line(done))
        if isinstance(known[scene.text], NoSection):
            raise known[scene.text]
        return Scene(known[scene.text])

    @property
    def cell(self):
        """Of the finest level, m."""
        case = self.case
        if "cell" in self.settings and "grid" not in case:
            return self.settings["cell"]
        return case["grid"][0]["cell_size"][0] * 0.5 ** depth_of(case)

    @property
    def said(self):
        """What sets it apart from the base."""
        base = self.study.setting.base
        return described(
            {name: value for name, value in self.settings.items() if name not in base or base[name] != value}
        )

    @property
    def safety(self):
        return self.case.get("time", [{}])[0].get("safety", [0.35])[0]

    @property
    def done(self):
        return bool(self.record["seconds"]) or bool(self.record["fault"])

    @property
    def good(self):
        return bool(self.record["seconds"]) and not self.record["fault"]

    @property
    def seconds(self):
        """Median of the repeats: the loop without the writing of files, times the ranks."""
        return statistics.median(self.record["seconds"]) * self.study.ranks

    @property
    def spread(self):
        """Largest less least of the repeats, per cent of the median."""
        values = self.record["seconds"]
        return 100 * (max(values) - min(values)) / statistics.median(values) if len(values) > 1 else None

    def go(self):
        """Run once more. A numerical fault is a result; a scene that is refused ends the study."""
        if not self.record["seconds"]:
            shutil.rmtree(self.directory, ignore_errors=True)
            self.directory.mkdir(parents=True)
            (self.directory / "scene.nml").write_text(self.text)
        start, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(
            [*self.study.launch, "-n", str(self.study.ranks), str(self.study.program)],
            input=self.text,
            cwd=self.directory,
            capture_output=True,
            text=True,
        )
        wall, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
        worked = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        (self.directory / "log").write_text(done.stdout + done.stderr)
        if done.returncode == 2 and not self.study.setting.lenient:
            raise Rejected(f"{self.directory}/scene.nml: {last_line(done)}")
        if done.returncode in (2, 3):
            self.record["fault"] = last_line(done)
        elif done.returncode != 0:
            raise Unreadable(
                f"{self.directory}: the run ended with status {done.returncode}: {last_line(done)}"
            )
        else:
            if not self.study.setting.program:
                seconds = self.measured()
            elif self.study.ranks > 1:
                seconds = self.printed(done.stdout)
            else:  # another job may have had the core for a while; start and end are in what was worked
                seconds = min(self.printed(done.stdout), worked)
            self.record["seconds"].append(seconds)
            self.record["sessions"].append(session)
        partial = self.directory / "study.json.part"
        partial.write_text(json.dumps(self.record))
        os.replace(partial, self.directory / "study.json")
        return wall

    def measured(self):
        """Seconds of the loop, from cost.dat: all but output, checkpoints and the estimate of the error at
        the end; on one rank those that the processor worked for it. Facts of the run into the record."""
        text = (self.directory / "cost.dat").read_text()
        notes = notes_of(self.directory / "cost.dat")
        names = {name[6:]: value for name, value in notes.items() if name.startswith("phase_")}
        rows = {
            names.get(str(int(float(line.split()[0]))), ""): float(line.split()[2])
            for line in text.splitlines()
            if re.match(r"\s*[-+]?\d", line)
        }
        if "all" not in rows:
            raise Unreadable(f"{self.directory}/cost.dat: no row `all`")
        for name, note in (("particles", "particles_at_start"), ("steps", "steps")):
            self.record[name] = int(notes[note]) if note in notes else None
        memory = notes.get("memory_at_start_B")
        self.record["megabytes"] = 1e-6 * float(memory) if memory else None
        seconds = rows["all"] - sum(rows.get(name, 0.0) for name in ("output", "checkpoint", "indicators"))
        return seconds * share_of_processors(float(notes.get("processor_share", 1)), self.study)

    def printed(self, log):
        """The same of another program: lines `study: NAME VALUE`."""
        said = {name: float(value) for name, value in re.findall(r"^ *study: (\w+) +(\S+)", log, re.M)}
        if "seconds" not in said:
            raise Unreadable(f"{self.directory}/log: no line `study: seconds`")
        self.record["printed"] = said
        for name in ("particles", "steps"):
            self.record[name] = int(said[name]) if name in said else None
        self.record["megabytes"] = said.get("megabytes")
        return said["seconds"]


def share_of_processors(share, study):
    """Which share of the time the processor worked for a run on one rank, by the program's own word: another
    job may have had it for the rest. Ranks that wait for each other work too."""
    return min(1.0, share) if share > 0 and study.ranks == 1 else 1.0


def last_line(done):
    said = (done.stdout + "\n" + done.stderr).splitlines()
    lines = [line.strip() for line in said if line.strip().startswith(("gimp3d:", "stopped:"))]
    return lines[-1] if lines else (done.stdout + done.stderr).strip()[-300:]


class Budget:
    """Runs in the order of their work, as far as they fit; then again for medians."""

    def __init__(self, seconds, say):
        self.left, self.say, self.rates = seconds, say, {}

    def work(self, run):
        """In proportion to particles times steps, as far as the settings say; the rate of a family makes up
        for the rest."""
        settings = run.settings
        grid = run.case.get("grid", [{}])[0]
        cell = grid["cell_size"][0] if grid else settings["cell"]
        particles = run.case.get("body", [{}])[0].get("particles_per_cell", [settings.get("particles", 8)])[0]
        safety = run.case.get("time", [{}])[0].get("safety", [settings.get("safety", 0.35)])[0]
        return cell**-4 * particles / safety / settings.get("speed", 1.0)

    def learn(self, family, run):
        self.rates[family] = run.record["seconds"][-1] / self.work(run)

    def expected(self, family, run):
        rates = [self.rates[family]] if family in self.rates else list(self.rates.values())
        return statistics.median(rates) * self.work(run) if rates else 0.0

    def first_pass(self, planned):
        """planned: (family, run); a run that stands in two families is run for the first."""
        first = {}
        for family, run in planned:
            first.setdefault(run, family)
            if run.good:
                self.learn(family, run)
        for run, family in sorted(first.items(), key=lambda pair: self.work(pair[0])):
            if run.done:
                continue
            expected = self.expected(family, run)
            if expected > self.left or self.left <= 0:
                self.say(
                    f"left out: {family}, {run.said}: about {expected:.0f} s, {self.left:.0f} s are left"
                )
                continue
            self.left -= run.go()
            if run.good:
                self.learn(family, run)
            took = f"{run.record['seconds'][-1]:.2f} s" if run.good else run.record["fault"]
            self.say(f"{family}, {run.said}: {took}")

    def repeats(self, runs, wanted):
        """Up to so many runs of each, the short ones first."""
        for _ in range(1, wanted):
            for run in sorted((run for run in runs if run.good), key=lambda run: run.seconds):
                if (
                    len(run.record["seconds"]) < wanted
                    and statistics.median(run.record["seconds"]) <= self.left
                ):
                    self.left -= run.go()


def described(settings):
    return ", ".join(
        f"{name}={value:.4g}" if isinstance(value, float) else f"{name}={value}"
        for name, value in settings.items()
    )
