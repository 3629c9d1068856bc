"""The knobs of a study: what it turns in the text of a scene."""

import math
import re

from .scene_text import BadSetting, Scene, is_flat
from .study_body import set_body

usual_cells = 1000000  # max_cells of a level that does not say it


def set_cell(scene, cell, setting):
    """Cells of another size; the grid's upper corner moves out to whole cells, and with it the sides of
    levels that lie there. A section stays one cell thick."""
    values = scene.values()
    grid = values["grid"][0]
    counts = [math.ceil((high - low) / cell * (1 - 1e-9)) for low, high in zip(grid["lower"], grid["upper"])]
    if is_flat(grid):
        counts[1] = 1
        scene.set("grid", "lower", grid["lower"])
    scene.set("grid", "cell_size", float(cell))
    # not rounded: surfaces lie on nodes
    upper = [low + count * cell for low, count in zip(grid["lower"], counts)]
    scene.set("grid", "upper", upper)
    for which, level in enumerate(values.get("level", [])):
        if "criterion" in level:  # as large a part of the body
            more = (grid["cell_size"][0] / cell) ** (2 if is_flat(grid) else 3)
            count = level.get("max_cells", [usual_cells])[0]
            scene.set("level", "max_cells", math.ceil(count * more), which)
            if "max_memory" in level:
                scene.set("level", "max_memory", level["max_memory"][0] * more, which)
        if "upper" not in level:  # a ball, or what the error places
            continue
        scene.set(
            "level",
            "upper",
            [
                new if abs(own - old) < 1e-9 * cell else own
                for own, old, new in zip(level["upper"], grid["upper"], upper)
            ],
            which,
        )


def side_that_moves(case, cell):
    """Of a grid that is not a whole number of such cells, a side that holds a body and would move away from
    it with set_cell: 'y+'; None where there is none."""
    grid = case["grid"][0]
    for axis, name in enumerate("xyz"):
        low, high = grid["lower"][axis], grid["upper"][axis]
        held = grid.get("boundary", ["free"] * 6)[2 * axis + 1] != "free"
        touches = any("upper" in body and body["upper"][axis] > high - 1e-6 * cell for body in case["body"])
        cells = (high - low) / cell
        if held and touches and abs(cells - round(cells)) > 1e-6 * cells:
            return f"{name}+"
    return None


def set_levels(scene, count, setting):
    """The first so many of the scene's levels, and after them of the study's `level_boxes`, as far as they
    lie in the grid."""
    grid = scene.values()["grid"][0]
    for lower, upper in setting.level_boxes:
        scene.add(
            "level",
            lower=[max(pair) for pair in zip(lower, grid["lower"])],
            upper=[min(pair) for pair in zip(upper, grid["upper"])],
        )
    if len(scene.groups("level")) < count:
        raise BadSetting(f"levels={count}: scene and study together have {len(scene.groups('level'))}")
    scene.remove("level", count)


fewest_placed = 1000  # cells: the least that `max_cells` may be


def set_placed(scene, share, setting):
    """A level that the error places, of at most so large a share of the grid's cells, for the scene's own. It
    begins where the first of the study's `level_boxes` is, if there are any."""
    grid = scene.values()["grid"][0]
    cells = [round((high - low) / grid["cell_size"][0]) for low, high in zip(grid["lower"], grid["upper"])]
    most = max(fewest_placed, math.ceil((4 if is_flat(grid) else 8) * share * math.prod(cells)))
    scene.remove("level")
    box = {}
    for lower, upper in setting.level_boxes[:1]:
        box["lower"] = [max(pair) for pair in zip(lower, grid["lower"])]
        box["upper"] = [min(pair) for pair in zip(upper, grid["upper"])]
    scene.add("level", **box, criterion="error", max_cells=most, tolerance=0.1)


def set_speed(scene, factor, setting):
    """Everything that is prescribed in time goes so many times as fast."""
    if factor == 1:
        return
    values = scene.values()
    scene.set("scene", "end_time", values["scene"][0]["end_time"][0] / factor)
    for group in ("tool", "motion", "pressure"):
        for which, one in enumerate(values.get(group, [])):
            if "times" not in one:  # a tool that only a &motion moves
                continue
            scene.set(group, "times", [t / factor for t in one["times"]], which)
            if "speeds" in one:
                scene.set(group, "speeds", [v * factor for v in one["speeds"]], which)
    if "time_step" in values.get("time", [{}])[0]:
        scene.set("time", "time_step", values["time"][0]["time_step"][0] / factor)


def in_group(group, variable):
    def change(scene, value, setting):
        scene.ensure(group)
        scene.set(group, variable, value)

    return change


def set_safety(scene, value, setting):
    in_group("time", "safety")(scene, value, setting)
    scene.set("time", "time_step", None)


def is_curved(case, body):
    """Whether a body's particles stand beside a surface that is not along the grid, and something presses on
    it: all but boxes and cylinders under tools that go along their axis; anything that is cut."""
    shape = body["shape"][0].lower()
    if "cut" in case or shape not in ("box", "cylinder"):
        return True
    if shape == "box":
        return False
    own = body.get("axis", [0.0, 0.0, 1.0])
    for tool in case.get("tool", []):
        axis = tool.get("axis", [0.0, 0.0, -1.0])
        along = abs(sum(a * b for a, b in zip(own, axis)))
        if along < (1 - 1e-9) * math.hypot(*own) * math.hypot(*axis):
            return True
    return any(
        all(low != high for low, high in zip(one["lower"], one["upper"])) for one in case.get("pressure", [])
    )


def set_fill(scene, value, setting):
    """How the particles fill bodies whose surface is curved."""
    case = scene.values()
    for which, body in enumerate(case["body"]):
        if is_curved(case, body):
            scene.set("body", "fill", value, which)


schemes = "explicit", "quasi_static"


def set_scheme(scene, value, setting):
    """Explicit steps, or quasi-static ones: twenty, where `steps` says nothing else."""
    if value not in schemes:
        raise BadSetting(f"scheme='{value}'; allowed: {', '.join(schemes)}")
    scene.remove("quasi_static")
    if value == "quasi_static":
        if scene.groups("time"):
            scene.set("time", "time_step", None)
        set_steps(scene, 20, setting)


def set_steps(scene, count, setting):
    """So many quasi-static steps to the end, about: those that meet a change of speed are shorter."""
    scene.ensure("quasi_static")
    step = scene.values()["scene"][0]["end_time"][0] / count
    for variable in ("step", "max_step"):
        scene.set("quasi_static", variable, step)


def take_out(scene, group, setting):
    """All groups of a name."""
    if not scene.groups(group):
        raise BadSetting(f"without='{group}': the scene has no &{group}")
    scene.remove(group)


knobs = {
    "cell": set_cell,
    "body": set_body,
    "fill": set_fill,
    "without": take_out,
    "levels": set_levels,
    "placed": set_placed,
    "speed": set_speed,
    "safety": set_safety,
    "time_step": in_group("time", "time_step"),
    "scheme": set_scheme,
    "steps": set_steps,
    "particles": in_group("body", "particles_per_cell"),
    "transfer": in_group("time", "transfer"),
    "domain": in_group("time", "domain"),
    "flip_fraction": in_group("time", "flip_fraction"),
    "stress_update": in_group("time", "stress_update"),
    "tolerance": in_group("contact", "tolerance"),
    "compliance": in_group("contact", "compliance"),
}


def turn(scene, knob, value, setting):
    """One knob, or group.variable (all groups of the name), or group(2).variable."""
    if knob in knobs:
        return knobs[knob](scene, value, setting)
    found = re.fullmatch(r"(\w+)(?:\((\d+)\))?\.(\w+)", knob)
    if not found:
        raise BadSetting(f"{knob}: unknown knob; there are {', '.join(knobs)}, and group.variable")
    which = int(found[2]) - 1 if found[2] else None
    if which is None:
        scene.ensure(found[1])
    scene.set(found[1], found[3], value, which)


def scene_of(text, settings, setting):
    """The scene with all knobs of a rung turned: the cells first, for levels lie on their grid, then the
    body, the speed last."""
    scene = Scene(text)
    for knob in sorted(settings, key=lambda knob: (knob != "cell", knob != "body", knob == "speed")):
        turn(scene, knob, settings[knob], setting)
    return scene


def is_about_point(probe):
    """Whether a probe of a scene is one of add_probes."""
    return probe.get("name", [""])[0].startswith("about_point_")


def add_probes(scene, point):
    """Eight probes about a point (on sides of symmetry: beside it), in the middles of the particles around it
    when it is a node of the grid; four in a section, whose particles all have y = 0. Their names begin with
    about_point_."""
    case = scene.values()
    grid, cell = case["grid"][0], case["grid"][0]["cell_size"][0]
    flat = is_flat(grid)
    if flat and point[1] != 0:
        raise BadSetting(f"point={list(point)}: with geometry='{grid['geometry'][0]}' y must be 0")
    axes = (0, 2) if flat else (0, 1, 2)
    inside = [
        all(
            one["lower"][i] - 1e-9 * cell <= point[i] <= one["upper"][i] + 1e-9 * cell
            for i in axes
        )
        for one in case.get("level", [])
        if "upper" in one
    ]
    cell *= 0.5 ** sum(inside)
    a_side = round(int(case["body"][0].get("particles_per_cell", [8])[0]) ** (1 / 3))
    off = cell / (2 * a_side)
    for corner in range(2 ** len(axes)):
        place = list(map(float, point))
        for bit, i in enumerate(axes):
            sign, x = 1 if corner >> bit & 1 else -1, point[i]
            at_low, at_high = abs(x - grid["lower"][i]) < 1e-6 * cell, abs(x - grid["upper"][i]) < 1e-6 * cell
            place[i] = float(f"{x + (off if at_low else -off if at_high else sign * off):.12g}")
        scene.add("probe", name=f"about_point_{corner}", position=place)
