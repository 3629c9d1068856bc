"""What the curve of an indentation is off by without scattering: parts of the uncertainties of `make hardness`
(doc/user/hardness.md, Uncertainties), and which numbers are not to be trusted.

All shares are of the number that they are a part of. The factors of `weights` were set on runs whose truth is
known, and are held to it by test/run indentation/known_truth."""

import math
from dataclasses import dataclass

import numpy as np

from . import oliver_pharr
from .layered import base_compliance

# Laws whose load does not depend on the rate: a load that falls while the tool stands still is inertia
rate_free = {"elastic", "neo_hookean", "j2", "cubic", "orthotropic", "drucker_prager"}
elastic = {"elastic", "neo_hookean", "cubic", "orthotropic"}  # all work comes back
constraint = 2.7  # hardness over the flow stress of metal, about
slow_in = 0.5  # of flow stress over (rho c): a tool that goes in as fast still has a quasi-static load
slow_back = 0.02  # of the load: what waves may carry off while the tool is drawn back
holds_on = 2.0  # times as long as the hold a load that has not come to rest goes on falling
limit = 0.15  # of a number: with a larger part of inertia it is not measured
loading_shares = (0.5, 0.9)  # of the largest depth: where the load in motion is taken from

worth_saying = 0.05  # of a cause, where something is not measured

# Keys of hardness.json by what they follow from
of_stiffness = [
    "stiffness",
    "unloading_exponent",
    "epsilon",
    "contact_depth",
    "area_oliver_pharr",
    "hardness_oliver_pharr",
    "modulus_oliver_pharr",
    "young_oliver_pharr",
]
of_area = ["area_true", "area_history", "hardness_true"]
of_both = ["modulus_true", "young_true"]

weights = {
    "lag": 1.0,  # of the stiffness, of what waves carry off
    "noise": 0.7,  # of the stiffness, of kinetic energy over the energy that comes back
    "drift": 0.5,  # of the stiffness, of the fall of a load that has not come to rest
    "stop_area": 0.6,  # of area and hardness, of the fall of the load at the stop
    "lost": 0.5,  # of the work, of what the energy balance lacks
    "cells_load": 0.05,  # of the load, over the cells to the radius of the contact
    "cells_stiffness": 0.08,  # of the stiffness
    "ring": 1 / math.sqrt(12),  # of the stiffness in a section, over the cells to the radius (parts_of)
    "cells_work": 0.15,  # of the energy that comes back
    "base": 1.0,  # of the stiffness, of what a rigid base adds
}


@dataclass
class Motion:
    """What a tool's motion leaves in its load, as shares: `stop` of the load, by which it falls while the
    tool stops and stands; `noise`, kinetic energy where the unloading begins over the energy that comes
    back; `lag`, what waves carry off during the unloading over the largest load; `drift`, how far the load
    would go on falling or rising while the tool is drawn back, over the largest load; speeds (m/s) of the way in
    and back, and those that would do."""

    stop: float = 0.0
    noise: float = 0.0
    lag: float = 0.0
    drift: float = 0.0
    speed_in: float = 0.0
    speed_back: float = 0.0
    enough_in: float = math.inf
    enough_back: float = math.inf

    @property
    def stiffness(self):
        """Part of the stiffness."""
        return math.hypot(
            weights["lag"] * self.lag, weights["noise"] * self.noise, weights["drift"] * self.drift
        )

    @property
    def returned(self):
        """Part of the energy that comes back, which goes with the square of the load over the stiffness."""
        return math.hypot(2 * self.stop, self.lag, self.noise)

    @property
    def area(self):
        return weights["stop_area"] * self.stop

    def cure(self):
        """What to do about it: the end of a sentence."""
        slower = [
            f"{self.shown(enough)} m/s on the way {way}"
            for way, speed, enough in (
                ("in", self.speed_in, self.enough_in),
                ("back", self.speed_back, self.enough_back),
            )
            if speed > 1.05 * enough
        ]
        if slower:
            return "take speed <= " + ", and ".join(slower)
        if not math.isfinite(self.enough_in):
            return "move the tool more slowly"
        return (
            "the tool is slow enough: take flip_fraction=0.97 in &time, which damps the motion of the "
            "particles, a longer hold, or finer cells"
        )

    @staticmethod
    def shown(speed):
        """Two digits, rounded down."""
        digits = 1 - math.floor(math.log10(speed))
        return f"{math.floor(speed * 10**digits * (1 + 1e-9)) / 10**digits:.4g}"


def wave_speed(material):
    """Of pressure waves (m/s); None of laws that have no Young's modulus."""
    if "young" not in material or "density" not in material:
        return None
    young, poisson = material["young"][0], material["poisson"][0]
    modulus = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    return math.sqrt(modulus / material["density"][0])


def is_static(case, time):
    """Whether steps at a time have no inertia."""
    one = case.get("quasi_static", [None])[0]
    if one is None or one.get("mode", ["static"])[0].lower() != "static":
        return False
    return one.get("from", [0.0])[0] <= time * (1 + 1e-9) and time < one.get("to", [math.inf])[0]


def load_in_motion(depth, load, until):
    """The load (N) at the depth of a row as a power law through the way in before it has it; None where too
    few rows are there."""
    rows = oliver_pharr.virgin_rows(np.asarray(depth), until)
    low, high = (share * depth[until] for share in loading_shares)
    rows = rows[(depth[rows] >= low) & (depth[rows] <= high)]
    rows = rows[load[rows] > 0]
    if rows.size < 5:
        return None
    slope, level = np.polyfit(np.log(depth[rows] / depth[until]), np.log(load[rows]), 1)
    return math.exp(level)


def motion_of(case, material, record, unloading, fit, area, returned, energy):
    """The Motion of one unloading, from the record (time, depth, load), its fit, the contact's area (m2), the
    share of the work that comes back, and the run's energies (None where there are none)."""
    time, depth, load = record.time, record.depth, record.load
    hold, start = unloading.hold, unloading.start
    free = material["model"][0].lower() in rate_free
    found = Motion()
    standing = load[hold + (start - hold) // 2 : start + 1]
    rest = float(np.mean(standing)) if start > hold else float(load[start])
    if free and not is_static(case, time[max(hold - 1, 0)]):
        moving = load_in_motion(depth, load, hold)
        if moving is not None:
            found.stop = max(1 - rest / moving, 0.0)
    speed = wave_speed(material)
    if not is_static(case, time[max(hold - 1, 0)]):
        found.speed_in = float(np.max(np.diff(depth[: hold + 1]) / np.diff(time[: hold + 1]), initial=0.0))
    if speed is not None and area > 0:
        impedance = material["density"][0] * speed
        found.enough_back = slow_back * rest / area / impedance
        # what flows feels a speed by its flow stress, what is elastic by its load
        found.enough_in = min(
            slow_in * rest / area / constraint / impedance, 2 * found.enough_back / max(returned, 1e-3)
        )
    if fit is None or is_static(case, time[start]):
        return found
    back = slice(start + fit.rows.start, start + fit.rows.stop)
    if energy is not None and returned > 0:
        work = float(np.max(energy["external_work"][energy["time"] <= time[start] * (1 + 1e-9)], initial=0.0))
        if work > 0:
            kinetic = float(np.interp(time[start], energy["time"], energy["kinetic"]))
            found.noise = kinetic / work / returned
    if free and start - hold >= 8:
        rows = slice(hold + (start - hold) // 2, start + 1)
        slope = float(np.polyfit(time[rows] - time[start], load[rows], 1)[0])
        lasts = min(float(time[back][-1] - time[start]), holds_on * float(time[start] - time[hold]))
        found.drift = abs(slope) * lasts / rest
    lasts = float(time[back][-1] - time[back][0])
    found.speed_back = float(depth[back][0] - depth[back][-1]) / lasts if lasts > 0 else 0.0
    if speed is not None and area > 0:
        found.lag = impedance * found.speed_back / (rest / area)
    return found


def cells_to_the_edge(area, cell):
    """Radius of the circle of a contact's area over the finest cell."""
    return math.sqrt(area / math.pi) / cell


def base_share(case, body, material, stiffness, axis):
    """By how much a rigid base adds to the stiffness of a block: q S / (E' t). 0 where the material has no
    Young's modulus, the body is no box or cylinder, or there are others."""
    along = int(np.argmax(np.abs(axis)))
    if "young" not in material or body["shape"][0] not in ("box", "cylinder") or len(case["body"]) > 1:
        return 0.0
    if body["shape"][0] == "box":
        thickness = body["upper"][along] - body["lower"][along]
    else:
        thickness = body["height"][0]
    poisson = material["poisson"][0]
    return base_compliance(poisson) * stiffness * (1 - poisson**2) / material["young"][0] / thickness


def parts_of(motion, cells, base, ratio, lost, of_reach, section=False):
    """{key of hardness.json: {cause: share of the number}} of what one run's curve does not show: causes
    inertia, cells, base, energy. `ratio` and `lost`: work ratio and lost energy over work, None where they
    are not known; `of_reach`: how much numbers change that follow from the stiffness, as a share of
    themselves over that of the stiffness. Of the work ratio the shares are differences. In an axisymmetric
    `section` the edge of the contact is a ring at one place of a cell, which moves on by whole cells, so that
    it is off by a cell's uniform distribution; about a circle in a 3D model that averages out."""
    load, stiff = weights["cells_load"] / cells, weights["cells_stiffness"] / cells
    if section:
        stiff = math.hypot(stiff, weights["ring"] / cells)
    base *= weights["base"]
    back = 1 - ratio if ratio is not None else 1.0
    found = {
        # elastic metal gives back what inertia adds; in plastic flow the load in motion is right
        "loading_curvature": {"inertia": motion.stop * back, "cells": load},
        "stiffness": {"inertia": motion.stiffness, "cells": stiff, "base": base},
        "area_true": {"inertia": motion.area},
        "area_history": {"inertia": motion.area},
        "hardness_true": {"inertia": motion.area},
    }
    for kind in ("modulus", "young"):
        found[f"{kind}_true"] = {
            "inertia": math.hypot(motion.stiffness, motion.area / 2),
            "cells": stiff,
            "base": base,
        }
        found[f"{kind}_oliver_pharr"] = {"inertia": motion.stiffness, "cells": stiff, "base": base}
    for key, share in of_reach.items():  # what the stiffness says of the way back
        found[key] = {cause: share * part for cause, part in found["stiffness"].items()}
    if ratio is not None:
        found["work_ratio"] = {
            "inertia": back * motion.returned,
            "cells": back * weights["cells_work"] / cells,
            "energy": weights["lost"] * (lost or 0.0),
        }
    return found


def not_measured(motion):
    """{key of hardness.json: sentence} of what is not to be trusted."""
    why = [
        sentence
        for share, sentence in (
            (motion.stop, "the load falls by {} when the tool stops"),
            (motion.noise, "kinetic energy where the unloading begins is {} of what that gives back"),
            (motion.drift, "the load is not at rest in the hold, and would go on by {}"),
            (motion.lag, "waves carry off {} of the load while the tool is drawn back"),
        )
        if share > worth_saying
    ]
    sentence = "not measured: " + "; ".join(why).replace("{}", "{:.2g} %").format(
        *(
            100 * share
            for share in (motion.stop, motion.noise, motion.drift, motion.lag)
            if share > worth_saying
        )
    )
    found = []
    if motion.stiffness > limit:
        found += of_stiffness
    if motion.area > limit:
        found += of_area
    if math.hypot(motion.stiffness, motion.area / 2) > limit:
        found += of_both
    return {key: f"{sentence}; {motion.cure()}" for key in dict.fromkeys(found)}
