"""Systematic errors of an indentation curve: contributions to the uncertainties of `make hardness`
(doc/user/hardness.md, Uncertainties), and numbers that are unreliable.

All shares are relative to the number that they contribute to. The factors of `weights` were calibrated on
runs with known results; test/run indentation/known_truth checks them."""

import math
from dataclasses import dataclass

import numpy as np

from . import oliver_pharr
from .layered import base_compliance

# Rate-independent laws: a load that falls during a hold is an effect of inertia
rate_free = {"elastic", "neo_hookean", "j2", "cubic", "orthotropic", "drucker_prager"}
flowing = {"maxwell", "norton"}  # laws whose stress relaxes with time under the load of an unloading
early = 0.8  # of the load: the unloading down to it has the rates that those of the hold are compared with
elastic = {"elastic", "neo_hookean", "cubic", "orthotropic"}  # all work is recovered
constraint = 2.7  # hardness over the flow stress of metal (Tabor), approximate
slow_in = 0.5  # largest speed of a quasi-static loading, over flow stress / (rho c)
slow_back = 0.02  # largest share of the load that waves may carry during the unloading
holds_on = 2.0  # a load that is not steady goes on falling for this multiple of the hold time
limit = 0.15  # largest relative error due to inertia; beyond it a number is not measured
loading_shares = (0.5, 0.9)  # of the largest depth: range from which the load in motion is extrapolated

worth_saying = 0.05  # smallest share of a cause that a message names

# Keys of hardness.json by the quantity that they are derived from
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
    "lag": 1.0,  # error of the stiffness over the share of the load carried by waves
    "noise": 0.7,  # error of the stiffness over the ratio of kinetic to recovered energy
    "drift": 0.5,  # error of the stiffness over the drift of a load that is not steady
    "stop_area": 0.6,  # error of area and hardness over the drop of the load at the stop
    "lost": 0.5,  # error of the work over the error of the energy balance
    "cells_load": 0.05,  # error of the load times the number of cells to the contact radius
    "cells_stiffness": 0.08,  # error of the stiffness, the same
    "ring": 1 / math.sqrt(12),  # error of the stiffness in a section, the same (parts_of)
    "cells_work": 0.15,  # error of the recovered energy, the same
    "base": 1.0,  # error of the stiffness over the share of a rigid base
}


@dataclass
class Motion:
    """Effects of inertia on the load of a tool. stop: drop of the load at the stop and in the hold, over the
    load; noise: kinetic energy at the start of the unloading over the recovered energy; lag: load carried by
    waves during the unloading, over the largest load; drift: extrapolated change of the load during the
    unloading, over the largest load; flow: rates of depth and load at the end of the hold over those of the
    unloading, or the share of the stress that relaxes during the fitted rows, of laws that creep or relax
    (infinite without a hold); quick: duration (s) of an unloading that leaves no time to relax; speeds (m/s)
    of loading and unloading, and those that are low enough."""

    stop: float = 0.0
    noise: float = 0.0
    lag: float = 0.0
    drift: float = 0.0
    flow: float = 0.0
    quick: float = math.inf
    speed_in: float = 0.0
    speed_back: float = 0.0
    enough_in: float = math.inf
    enough_back: float = math.inf

    @property
    def stiffness(self):
        """Relative error of the stiffness."""
        return math.hypot(
            weights["lag"] * self.lag, weights["noise"] * self.noise, weights["drift"] * self.drift
        )

    @property
    def returned(self):
        """Relative error of the recovered energy, which is proportional to the square of the load over the
        stiffness."""
        return math.hypot(2 * self.stop, self.lag, self.noise)

    @property
    def area(self):
        return weights["stop_area"] * self.stop

    def cure(self):
        """The remedy: the end of a sentence."""
        slower = [
            f"{self.shown(enough)} m/s for the {way}"
            for way, speed, enough in (
                ("loading", self.speed_in, self.enough_in),
                ("unloading", self.speed_back, self.enough_back),
            )
            if speed > 1.05 * enough
        ]
        if slower:
            return "use speed <= " + " and ".join(slower)
        if not math.isfinite(self.enough_in):
            return "reduce the speed of the tool"
        return (
            "the tool is slow enough: use flip_fraction=0.97 in &time (damps the motion of the particles), "
            "a longer hold or finer cells"
        )

    @staticmethod
    def shown(speed):
        """Two digits, rounded down."""
        digits = 1 - math.floor(math.log10(speed))
        return f"{math.floor(speed * 10**digits * (1 + 1e-9)) / 10**digits:.4g}"


def wave_speed(material):
    """Speed of pressure waves (m/s); None for laws without Young's modulus."""
    if "young" not in material or "density" not in material:
        return None
    young, poisson = material["young"][0], material["poisson"][0]
    modulus = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    return math.sqrt(modulus / material["density"][0])


def is_static(case, time):
    """Whether the steps at a time are quasi-static."""
    one = case.get("quasi_static", [None])[0]
    if one is None or one.get("mode", ["static"])[0].lower() != "static":
        return False
    return one.get("from", [0.0])[0] <= time * (1 + 1e-9) and time < one.get("to", [math.inf])[0]


def load_in_motion(depth, load, until):
    """The load (N) at the depth of a row, extrapolated from the loading before it by a power law; None if
    there are too few rows."""
    rows = oliver_pharr.virgin_rows(np.asarray(depth), until)
    low, high = (share * depth[until] for share in loading_shares)
    rows = rows[(depth[rows] >= low) & (depth[rows] <= high)]
    rows = rows[load[rows] > 0]
    if rows.size < 5:
        return None
    slope, level = np.polyfit(np.log(depth[rows] / depth[until]), np.log(load[rows]), 1)
    return math.exp(level)


def motion_of(case, material, record, unloading, fit, area, returned, energy):
    """The Motion of one unloading. record: time, depth, load; fit: of the unloading; area: of the contact
    (m2); returned: recovered share of the work; energy: energies of the run, or None."""
    time, depth, load = record.time, record.depth, record.load
    hold, start = unloading.hold, unloading.start
    free = material["model"][0].lower() in rate_free
    found = Motion()
    if fit is not None and material["model"][0].lower() in flowing:
        found.flow, found.quick = flow_of(material, record, unloading, fit)
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
        # the limit follows from the flow stress in plastic flow, and from the load in elastic deformation
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


def flow_of(material, record, unloading, fit):
    """Motion's flow and quick. A law that creeps goes on as it does at the end of the hold, which adds the
    ratio of the rates to the compliance (Feng & Ngan, J. Mater. Res. 17 (2002) 660); a branch of maxwell
    relaxes by its time."""
    time, depth, load = record.time, record.depth, record.load
    hold, start = unloading.hold, unloading.start
    quick = math.inf
    relaxed = 0.0
    if "relaxation_times" in material:
        times = [value for value in material["relaxation_times"]]
        back = time[start : unloading.end + 1][fit.rows]
        lasts = float(back[-1] - time[start])
        for name in ("shear_ratios", "bulk_ratios"):
            ratios = material.get(name, [0.0] * len(times))
            share = sum(ratio * -math.expm1(-lasts / one) for ratio, one in zip(ratios, times))
            relaxed = max(relaxed, share)
            rate = sum(ratio / one for ratio, one in zip(ratios, times))
            quick = min(quick, 0.5 * limit / rate) if rate > 0 else quick
    if start - hold < 8:
        return math.inf, quick
    rows = slice(hold + (start - hold) // 2, start + 1)
    below = start + int(np.argmax(load[start : unloading.end + 1] < early * load[start]))
    below = below if below > start else unloading.end
    rates = 0.0
    for values in (load, depth):
        back = abs(float(values[below] - values[start])) / float(time[below] - time[start])
        rates += abs(float(np.polyfit(time[rows] - time[start], values[rows], 1)[0])) / max(back, 1e-300)
    return math.hypot(rates, relaxed), quick


def cells_to_the_edge(area, cell):
    """Equivalent contact radius over the size of the finest cells."""
    return math.sqrt(area / math.pi) / cell


def base_share(case, body, material, stiffness, axis):
    """Relative increase of the stiffness of a block by a rigid base: q S / (E' t). 0 if the material has no
    Young's modulus, the body is not a box or cylinder or has a &cut, or there are several bodies."""
    along = int(np.argmax(np.abs(axis)))
    simple = body["shape"][0] in ("box", "cylinder") and len(case["body"]) == 1 and "cut" not in case
    if "young" not in material or not simple:
        return 0.0
    if body["shape"][0] == "box":
        thickness = body["upper"][along] - body["lower"][along]
    else:
        thickness = body["height"][0]
    poisson = material["poisson"][0]
    return base_compliance(poisson) * stiffness * (1 - poisson**2) / material["young"][0] / thickness


def parts_of(motion, cells, base, ratio, lost, of_reach, section=False):
    """{key of hardness.json: {cause: relative error}} of systematic errors that the curve of one run does not
    show: causes inertia, cells, base, energy. ratio, lost: work ratio and lost energy over work, None if
    unknown; of_reach: relative change of derived numbers over that of the stiffness. The values for the work
    ratio are absolute. In an axisymmetric `section` the contact edge is a ring at one position in a cell, and
    advances by whole cells: its error has the uniform distribution over a cell. In a 3D model it averages
    out along the edge."""
    load, stiff = weights["cells_load"] / cells, weights["cells_stiffness"] / cells
    if section:
        stiff = math.hypot(stiff, weights["ring"] / cells)
    base *= weights["base"]
    back = 1 - ratio if ratio is not None else 1.0
    found = {
        # elastic metal: the inertial part of the load is recovered; plastic flow: the load in motion is right
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
    if motion.flow > 0:
        for key in ("stiffness", *of_both, "modulus_oliver_pharr", "young_oliver_pharr"):
            found[key]["flow"] = min(motion.flow, 1.0)
    for key, share in of_reach.items():  # derived from the stiffness
        found[key] = {cause: share * part for cause, part in found["stiffness"].items()}
    if ratio is not None:
        found["work_ratio"] = {
            "inertia": back * motion.returned,
            "cells": back * weights["cells_work"] / cells,
            "energy": weights["lost"] * (lost or 0.0),
        }
    return found


def not_measured(motion):
    """{key of hardness.json: sentence} of the unreliable numbers."""
    why = [
        sentence
        for share, sentence in (
            (motion.stop, "the load falls by {} when the tool stops"),
            (motion.noise, "the kinetic energy at the start of the unloading is {} of the recovered energy"),
            (motion.drift, "the load is not steady in the hold and would change by a further {}"),
            (motion.lag, "waves carry {} of the load during the unloading"),
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
    said = {key: f"{sentence}; {motion.cure()}" for key in dict.fromkeys(found)}
    if motion.flow > limit:
        said |= {key: flow_sentence(motion) for key in (*of_stiffness, *of_both)}
    return said


def flow_sentence(motion):
    """Why an unloading of a law that flows says nothing of its modulus, and what to do."""
    why = "the unloading does not follow a hold of 8 rows or more"
    if math.isfinite(motion.flow):
        why = f"creep or relaxation during the unloading is {100 * motion.flow:.2g} % of it"
    quick = f", in less than {motion.quick:.2g} s" if math.isfinite(motion.quick) else ""
    return (
        f"not measured: {why}: the law flows, and the slope is not that of the elastic modulus; hold the "
        f"tool until load and depth no longer change, then unload faster{quick}"
    )
