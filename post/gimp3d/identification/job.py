"""The request for an identification: KEY=VALUE words as tips with their data, settings, and known
parameters."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import measured, observed
from .laws import KNOWN
from .tips import read_tip

KEYS = {
    "DATA", "TIP", "LAW", "FIX", "FREE", "NOISE", "POISSON", "TIP_YOUNG", "TIP_POISSON", "CACHE", "SHIPPED",
    "CORES", "PLAN", "REFINE", "OUT", "SCENE", "PARAMETERS", "COLUMNS", "PROGRAM", "CHECK", "ROUNDS",
    "WRITE", "TIPS", "INTERVALS",
}  # fmt: skip


class BadRequest(Exception):
    """The request cannot be met; the text gives the reason and what is allowed."""


@dataclass
class Job:
    """The request: tips with their files, and the settings."""

    groups: list = field(default_factory=list)  # (Tip, [files])
    settings: dict = field(default_factory=dict)
    words: list = field(default_factory=list)
    notes: list = field(default_factory=list)

    @property
    def title(self):
        return "Material from " + ", ".join(Path(name).name for _, names in self.groups for name in names)

    @property
    def poisson(self):
        return self.number("POISSON", 0.3)

    @property
    def law(self):
        name = {"j2": "power"}.get(self.settings.get("LAW", "power"), self.settings.get("LAW", "power"))
        if name not in KNOWN:
            raise BadRequest(
                f"LAW={name}: allowed for tips are {', '.join(KNOWN)}; else use the general form (SCENE=)"
            )
        return KNOWN[name]

    @property
    def tip_compliance(self):
        """(1 - nu^2)/E of the tip, 1/Pa; 0: rigid."""
        young = self.number("TIP_YOUNG", 0.0)
        return (1 - self.number("TIP_POISSON", 0.07) ** 2) / young if young else 0.0

    def number(self, key, default):
        if key not in self.settings:
            return default
        try:
            return float(self.settings[key])
        except ValueError:
            raise BadRequest(f"{key}={self.settings[key]}: must be a number")


def read_job(arguments):
    """A Job of KEY=VALUE words."""
    job, data = Job(words=list(arguments)), None
    for word in arguments:
        key, equals, value = word.partition("=")
        key = key.lstrip("-").upper().replace("-", "_")
        if not equals or key not in KEYS:
            raise BadRequest(f"{word}: must be KEY=VALUE; the keys are {', '.join(sorted(KEYS))}")
        if key == "DATA":
            if data is not None:
                raise BadRequest(f"{word}: the preceding DATA has no TIP")
            data = value.split(",")
        elif key == "TIP":
            if data is None:
                raise BadRequest(f"{word}: must follow its DATA")
            job.groups.append((read_tip(value), data))
            data = None
        elif key in job.settings:
            raise BadRequest(f"{word}: {key} is given twice")
        else:
            job.settings[key] = value
    if data is not None and "SCENE" not in job.settings:
        raise BadRequest(f"DATA={','.join(data)}: must be followed by a TIP, as TIP=berkovich")
    if data is not None:
        job.settings["DATA"] = ",".join(data)
    if not job.groups and not {"SCENE", "TIPS"} & set(job.settings):
        raise BadRequest("no data: give DATA=curve.csv TIP=berkovich")
    return job


def observe(job):
    """An Observed for each tip."""
    free = [name for name in job.settings.get("FREE", "").split(",") if name]
    unknown = [name for name in free if name not in observed.FREE]
    if unknown:
        raise BadRequest(f"FREE={unknown[0]}: allowed are {', '.join(observed.FREE)}")
    noise = job.number("NOISE", 0.0) / 100 or None
    found = []
    for tip, names in job.groups:
        read = [measured.read_curve(name) for name in names]
        rows = [row for one in read if isinstance(one, list) for row in one]
        curves = [one for one in read if isinstance(one, measured.Curve)]
        if rows and curves:
            raise BadRequest(f"DATA={','.join(names)}: give curves and derived numbers as separate DATA")
        if rows:
            found.append(observed.from_derived(tip, rows))
        else:
            found += [observed.from_curves(tip, some, free, noise) for some in alike(tip, curves)]
    return found


SAME_DEPTH = 0.05  # relative difference of depth within which curves of a tip with a length share runs


def alike(tip, curves):
    """Groups of curves that share a set of runs: all curves of a sharp tip, those of similar depth of another
    tip."""
    if not tip.has_length:
        return [curves]
    groups = []
    for curve in sorted(curves, key=observed.depth_of, reverse=True):
        if not groups or observed.depth_of(curve) < (1 - SAME_DEPTH) * observed.depth_of(groups[-1][0]):
            groups.append([])
        groups[-1].append(curve)
    return groups


def priors_of(job):
    """FIX=name=value:uncertainty,... -> number of the parameter: value of p, sigma."""
    found = {}
    for word in filter(None, job.settings.get("FIX", "").split(",")):
        name, _, value = word.partition("=")
        number, _, share = value.partition(":")
        try:
            value, sigma = float(number), float(share or 0.01)
        except ValueError:
            raise BadRequest(f"FIX={word}: must be NAME=VALUE or NAME=VALUE:UNCERTAINTY")
        if name == "young":
            star = 1 / ((1 - job.poisson**2) / value + job.tip_compliance)
            found[0] = float(np.log(star)), sigma
        elif name == "modulus":
            found[0] = float(np.log(value)), sigma
        elif name == "yield_stress":
            found[1] = float(np.log(value)), sigma
        else:
            place = job.law.coordinate(name, value, None) if name in job.law.names else None
            if place is None:
                allowed = [n for n in job.law.names if job.law.coordinate(n, 1.0, None)]
                raise BadRequest(
                    f"FIX={word}: allowed are {', '.join(['young', 'modulus', 'yield_stress', *allowed])}"
                )
            found[2 + place[0]] = place[1], sigma
    return found


def check_parameters(job, priors):
    """Check PARAMETERS: the other parameters of the law must be in FIX."""
    if "PARAMETERS" not in job.settings:
        return
    law = job.law
    asked = [name.strip() for name in job.settings["PARAMETERS"].split(",")]
    asked = [{"young": "modulus"}.get(name, name) for name in asked]
    if "hardening" in asked:
        asked += law.names
    for name in asked:
        if name not in (*law.parameters, "hardening"):
            raise BadRequest(
                f"PARAMETERS={name}: LAW={law.name} has young, {', '.join(law.parameters[1:])}, hardening"
            )
    held = set(law.parameters) - set(asked)
    for name in sorted(held):
        place = {"modulus": 0, "yield_stress": 1}.get(name)
        if place is None:
            found = law.coordinate(name, 1.0, None)
            place = 2 + found[0] if found else None
        if place not in priors:
            raise BadRequest(f"PARAMETERS: {name} is not listed, so it must be given by FIX={name}=VALUE")
