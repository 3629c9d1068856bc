"""What is read off the runs of the book of benchmarks: loads, stiffness, areas, work; in SI units."""

import argparse
import math
import tomllib
from functools import lru_cache
from pathlib import Path

import numpy as np

from . import hardness
from . import indentation
from . import oliver_pharr
from .benchmark_scenes import plane_modulus, poisson
from .layered import base_compliance
from .plots import Run
from .run_data import History, Unreadable

area_name = "true area over that of the load"
reach = 0.1  # of the depth, either way: rows that a load is taken from


@lru_cache(maxsize=None)
def base_share():
    return base_compliance(poisson)


@lru_cache(maxsize=64)
def record_of(directory):
    """Depth (m) and load (N) of the full body while the tool goes in."""
    run = Run(Path(directory))
    try:
        return run, hardness.Record(run, run.tools[0])
    except hardness.Missing as error:
        raise Unreadable(str(error))


def smooth_load(depth, load, at):
    """The load at a depth and its uncertainty: a parabola through the rows within `reach` of it."""
    going = slice(0, int(np.argmax(depth)) + 1)
    depth, load = depth[going], load[going]
    used = np.abs(depth / at - 1) <= reach
    if np.count_nonzero(used) < 8 or depth[-1] < at * (1 - 1e-9):
        raise Unreadable(f"the run has too few rows about a depth of {1e9 * at:.4g} nm")
    x, y = depth[used] / at - 1, load[used]
    base = np.stack([np.ones(x.size), x, x**2], axis=1)
    found, *_ = np.linalg.lstsq(base, y, rcond=None)
    left = y - base @ found
    spread = float(left @ left) / max(x.size - 3, 1) * oliver_pharr.correlation_time(left)
    return float(found[0]), math.sqrt(spread * np.linalg.inv(base.T @ base)[0, 0])


def load_at(directory, depth):
    """Load (N) of the full body at a depth (m), as the block has it, and its uncertainty."""
    _, record = record_of(str(directory))
    return smooth_load(record.depth, record.load, depth)


def load_at_time(directory, time):
    """Load (N) of the full body at a time (s)."""
    _, record = record_of(str(directory))
    if record.time[-1] < time:
        raise Unreadable(f"the run ends before {time:.4g} s")
    return float(np.interp(time, record.time, record.load))


def load_of_half_space(directory, grid, depth, modulus=plane_modulus, share=None):
    """The same of a half-space: what the rigid base takes off the depth is added, of a block of this plane
    modulus (Pa); `share` is its base_compliance."""
    _, record = record_of(str(directory))
    added = (share or base_share()) * record.load / (modulus * grid.thickness)
    return smooth_load(record.depth + added, record.load, depth)


def mean_pressure(directory):
    """Load over true area (Pa) of a sharp tool, over the last part of its way in that `make hardness` takes
    the area from."""
    _, record = record_of(str(directory))
    end = int(np.argmax(record.depth))
    first = int(np.argmax(record.depth >= (1 - hardness.area_share) * record.depth[end]))
    return float(record.load[first : end + 1].sum() / record.area[first : end + 1].sum())


def area_of_load(directory, radii, loads):
    """True area over that of the exact contact, of radii (m) under loads (N, rising), under the load that there
    is: mean over the last quarter of the depth."""
    _, record = record_of(str(directory))
    end = int(np.argmax(record.depth))
    used = slice(int(np.argmax(record.depth >= 0.75 * record.depth[end])), end + 1)
    exact = math.pi * np.interp(record.load[used], loads, radii) ** 2
    return {area_name: float(np.mean(record.area[used] / exact))}


def kinetic(directory):
    """Largest kinetic energy over work, from half of the largest depth on until there."""
    run, record = record_of(str(directory))
    end = int(np.argmax(record.depth))
    half = int(np.argmax(record.depth >= 0.5 * record.depth[end]))
    energy = History(run.directory / "energy.dat")
    return {"kinetic": indentation.kinetic_share(energy, record.time[half], record.time[end])}


@lru_cache(maxsize=64)
def analysed(directory):
    """What `make hardness` says of a run, with what it does not trust."""
    options = argparse.Namespace(
        tool=None, window=(20.0, 98.0), epsilon=None, beta=None, area_coefficients=None, area="auto"
    )
    try:
        run = Run(Path(directory))
        answer = hardness.analyse(run, hardness.Record(run, hardness.chosen_tool(run, None)), options)[0]
    except hardness.Missing as error:
        raise Unreadable(str(error))
    for key, (value, sigma) in answer["untrusted"].items():  # the book judges these numbers too
        answer[key], answer[f"{key}_uncertainty"] = value, sigma
    return answer


def sharp(directory, grid, yield_stress):
    """A pointed tool in and out, freed of the rigid base: depth, stiffness and work of a half-space."""
    answer = analysed(str(directory))
    lacking = [k for k in ("loading_curvature", "stiffness", "work_ratio") if answer.get(k) is None]
    if lacking:
        raise Unreadable(f"{directory}: {' '.join(answer['missing'])}")
    top, stiffness = answer["max_depth"], answer["stiffness"]
    give = base_share() / (plane_modulus * grid.thickness)  # m/N
    load = answer["loading_curvature"] * top**2
    depth = top + give * load
    slope = 1 / (1 / stiffness + give)
    more = 0.5 * give * answer["max_load"] ** 2
    total, elastic = answer["work_total"] + more, answer["work_elastic"] + more
    found = {
        "C/Y": load / depth**2 / yield_stress,
        "S/(E'h)": slope / (plane_modulus * depth),
        "Wp/Wt": 1 - elastic / total,
        "S, uncertainty": answer["stiffness_uncertainty"] / stiffness,
        "exponent": answer["loading_exponent"],
        "kinetic": answer["kinetic_share"],
        "base's share": slope / stiffness - 1,
    }
    for name, area in (("true area", "area_true"), ("area of the profile", "area_profile")):
        if answer.get(area):
            found[f"H/Y, {name}"] = answer["max_load"] / answer[area] / yield_stress
    return found


def error_of_oliver_pharr(directory):
    """How much too high hardness and modulus come out by the area of Oliver and Pharr, beside those by the
    true area."""
    answer = analysed(str(directory))
    true, taken = answer.get("area_true"), answer.get("area_oliver_pharr")
    if not true or not taken:
        raise Unreadable(f"{directory}: {' '.join(answer['missing'])}")
    return {
        "hardness too high by": true / taken - 1,
        "modulus too high by": math.sqrt(true / taken) - 1,
        "kinetic": answer["kinetic_share"],
    }


# ---- collisions ----


def collision(depths, loads, turn, time):
    """Mass (kg) and speed (m/s) of a body that turns at depths[turn] after half of `time` (s), and that depth
    (m), load (N), time: m v dv = -F dh, so t = 2 int dh / sqrt(v^2 - 2 W(h)/m)."""
    from scipy.interpolate import PchipInterpolator
    from scipy.integrate import quad

    # loads over h^1.5 hardly bend
    h, f = np.array(depths[1:]), np.array(loads[1:])
    law = PchipInterpolator(np.r_[0, h], np.r_[2 * f[0] / h[0] ** 1.5 - f[1] / h[1] ** 1.5, f / h**1.5])
    top = depths[turn]
    grid = np.linspace(0, top, 4001)
    force = law(grid) * grid**1.5
    work = np.r_[0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(grid))]
    left = PchipInterpolator(grid, 1 - work / work[-1])
    # h = top (1 - s^2): the root at the turning point goes away
    whole = (
        2
        * quad(
            lambda s: 2 * top * s / math.sqrt(max(float(left(top * (1 - s * s))), 1e-300)), 1e-6, 1, limit=200
        )[0]
    )
    speed = whole / time
    mass = 2 * float(work[-1]) / speed**2
    return mass, speed, top, float(loads[turn]), time


def struck(directory):
    """Of a tool that was thrown back: largest depth (m), largest load (N), time of contact (s), speed at the
    end (m/s)."""
    _, record = record_of(str(directory))
    touching = np.flatnonzero(record.load > 0)
    if touching[-1] == record.load.size - 1:
        raise Unreadable(f"{directory}: the tool is not free at the end of the run")
    top = float(np.max(record.depth))
    near = record.depth >= 0.97 * top
    base = np.polyfit(record.time[near] - record.time[near].mean(), record.load[near], 2)
    load = float(base[2] - base[1] ** 2 / (4 * base[0])) if base[0] < 0 else float(np.max(record.load))
    free = slice(touching[-1] + 1, None)
    speed = -float(np.polyfit(record.time[free], record.depth[free], 1)[0])
    return {"depth": top, "load": load, "time": float(record.time[touching[-1] + 1]), "speed": speed}


# ---- the analysis ----


def instrument_case(root, name):
    return tomllib.loads((root / "test/references/oliver_pharr.toml").read_text())[name]


def instrument(root, name):
    """Hardness and modulus (GPa) that post/gimp3d/oliver_pharr.py gives for an instrument's numbers."""
    case = instrument_case(root, name)
    area = oliver_pharr.fitted_area(case["coefficients"])(
        oliver_pharr.contact_depth(case["depth"], case["load"], case["stiffness"], 0.75)
    )
    young = oliver_pharr.young_modulus(
        oliver_pharr.reduced_modulus(case["stiffness"], area), case["poisson"], 1141e9, 0.07
    )
    return {"H [GPa]": 1e-9 * case["load"] / area, "E [GPa]": 1e-9 * young}


def instrument_references(root, name, make):
    case = instrument_case(root, name)
    return [make("H [GPa]", 1e-9 * case["hardness"], 2e-6), make("E [GPa]", 1e-9 * case["young"], 2e-6)]
