"""Scenes as text that is edited: values of namelist groups, and the knobs of a study made of them."""

import math
import re

from run_data import read_namelists, words_of_group

group_start = re.compile(r"^[ \t]*&(\w+)", re.M)


class BadSetting(Exception):
    """What a study asks for is not there; the text says what."""


def written(value):
    """A value as a namelist has it; lists with commas."""
    if isinstance(value, (list, tuple)):
        return ",".join(written(part) for part in value)
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return repr(value)


class Scene:
    """The text of a scene. Groups are counted from 0, among those of their name."""

    def __init__(self, text):
        self.text = text

    def groups(self, name):
        """For each group of this name: where it starts and ends, where its `/` stands, and the span of the
        values of each variable."""
        found, at = [], 0
        while start := group_start.search(self.text, at):
            spans, current, before = {}, None, start.end()
            for word in words_of_group(self.text, start.end(), start[1]):
                at = word.end()
                if word["end"]:
                    slash = before
                elif word["name"]:
                    current = word["name"].lower()
                    spans[current] = (word.start(), word.end())
                else:
                    spans[current] = (spans[current][0], word.end())
                before = word.end()
            if start[1].lower() == name:
                found.append((start.start(), at, slash, spans))
        return found

    def values(self):
        """As run_data.read_namelists."""
        return read_namelists(self.text)

    def set(self, group, variable, value, which=None):
        """Give a variable a value (None: take it out) in all groups of a name, or in one."""
        groups = self.groups(group)
        if which is not None:
            groups = groups[which : which + 1]
        if not groups:
            raise BadSetting(
                f"the scene has no &{group}" + (f" number {which + 1}" if which is not None else "")
            )
        for start, end, slash, spans in reversed(groups):
            if variable in spans:
                first, last = spans[variable]
                new = "" if value is None else f"{variable}={written(value)}"
                if value is None:
                    last = re.compile(r"[ \t]*,?[ \t]*").match(self.text, last).end()
                self.text = self.text[:first] + new + self.text[last:]
            elif value is not None:
                comma = ", " if spans else " "
                self.text = self.text[:slash] + f"{comma}{variable}={written(value)}" + self.text[slash:]

    def add(self, group, **variables):
        """A group more, at the end."""
        listed = ", ".join(f"{name}={written(value)}" for name, value in variables.items())
        self.text = self.text.rstrip("\n") + f"\n&{group} {listed} /\n"

    def remove(self, group, first=0):
        """Take out the groups of a name, from the first-th on."""
        for start, end, _, _ in reversed(self.groups(group)[first:]):
            self.text = self.text[:start] + self.text[end:].lstrip(" \t")

    def ensure(self, group):
        if not self.groups(group):
            self.add(group)


# ---- knobs
# ------------------------------------------------------------------------------------------------------------


usual_cells = 1000000  # max_cells of a level that does not say it


def set_cell(scene, cell, setting):
    """Cells of another size; the grid's upper corner moves out to whole cells, and with it the sides of
    levels that lie there."""
    values = scene.values()
    grid = values["grid"][0]
    counts = [math.ceil((high - low) / cell * (1 - 1e-9)) for low, high in zip(grid["lower"], grid["upper"])]
    scene.set("grid", "cell_size", float(cell))
    # not rounded: surfaces lie on nodes
    upper = [low + count * cell for low, count in zip(grid["lower"], counts)]
    scene.set("grid", "upper", upper)
    for which, level in enumerate(values.get("level", [])):
        if "criterion" in level:  # as large a part of the body
            more = (grid["cell_size"][0] / cell) ** 3
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


def set_body(scene, factor, setting):
    """All that is bonded together so many times as large, towards what is far from the tools: away from them
    and to the sides, but for sides of symmetry. The grid goes along by whole cells, and levels that end at
    its sides."""
    values = scene.values()
    grid, bodies = values["grid"][0], values["body"]
    boxes = [box_of(body) for body in bodies]
    lower, upper = box_around(values)
    cell, free = grid["cell_size"][0], free_sides(values, lower, upper)
    moves = [0.0] * 6  # of the sides x-, x+, y-, ..., outwards
    for side in free:
        axis = side // 2
        share = (factor - 1) * (upper[axis] - lower[axis]) / sum(one // 2 == axis for one in free)
        whole = round(share / cell)
        moves[side] = share if abs(share / cell - whole) < 1e-9 * whole else whole * cell
    if not any(moves):
        raise BadSetting(f"body={factor:g}: no side moves by a whole cell")
    for which, (body, box) in enumerate(zip(bodies, boxes)):
        grow_body(scene, which, body, box, (lower, upper), moves)
    old = grid["lower"], grid["upper"]
    new = [[x - m for x, m in zip(old[0], moves[::2])], [x + m for x, m in zip(old[1], moves[1::2])]]
    scene.set("grid", "lower", new[0])
    scene.set("grid", "upper", new[1])
    for which, level in enumerate(values.get("level", [])):
        for name, was, now in zip(("lower", "upper"), old, new):
            if name in level:
                ends = [b if abs(x - a) < 1e-9 * cell else x for x, a, b in zip(level[name], was, now)]
                scene.set("level", name, ends, which)


def box_around(values):
    """Lower and upper corner of what all bodies fill of the grid."""
    grid, boxes = values["grid"][0], [box_of(body) for body in values["body"]]
    lower = [max(min(ends), side) for ends, side in zip(zip(*(box[0] for box in boxes)), grid["lower"])]
    upper = [min(max(ends), side) for ends, side in zip(zip(*(box[1] for box in boxes)), grid["upper"])]
    return lower, upper


def size_of(values):
    """Of all bodies together: the mean edge of the box around them, m."""
    return math.prod(high - low for low, high in zip(*box_around(values))) ** (1 / 3)


def box_of(body):
    """Lower and upper corner of a body that `set_body` can make larger."""
    shape = body["shape"][0].lower()
    if shape == "box":
        return body["lower"], body["upper"]
    if shape == "cylinder" and list(map(abs, body.get("axis", [0, 0, 1]))) == [0, 0, 1]:
        (x, y, z), r = body["center"], body["radius"][0]
        h = body["height"][0] * body.get("axis", [0, 0, 1])[2]
        return [x - r, y - r, min(z, z + h)], [x + r, y + r, max(z, z + h)]
    raise BadSetting(f"body: a {shape} is not made larger, a box or a cylinder along z is")


def free_sides(values, lower, upper):
    """The sides (0: x-, 1: x+, 2: y-, ...) by which bodies differ from a half-space that is pressed within
    one face. Raises BadSetting where more than these would differ."""
    bodies, boundary = values["body"], values["grid"][0].get("boundary", ["free"] * 6)
    symmetric = [side for side in range(6) if boundary[side].lower() == "symmetry"]
    for group in ("gravity", "cut", "grains", "body_contact"):
        if group in values:
            raise BadSetting(f"body: the scene has a &{group}")
    if len({body.get("contact_group", [""])[0] for body in bodies}) > 1:
        raise BadSetting("body: more than one contact group")
    if any(any(body.get(name, [0])) for body in bodies for name in ("velocity", "angular_velocity")):
        raise BadSetting("body: it moves at the start")
    reaches = [footprint_of_tool(tool) for tool in values.get("tool", [])]
    reaches += [footprint_of_pressure(one, lower, upper) for one in values.get("pressure", [])]
    pressed = {side for side, _, _ in reaches}
    if len(pressed) != 1:
        raise BadSetting(f"body: pressed from {len(pressed)} sides; it has to be one")
    pressed = pressed.pop()
    if pressed ^ 1 in symmetric:
        raise BadSetting("body: the side opposite the pressed one is one of symmetry")
    if pressed < 4 and any(body["shape"][0].lower() == "cylinder" for body in bodies):
        raise BadSetting("body: a cylinder that is pressed from the side")
    free = [side for side in range(6) if side != pressed and side not in symmetric]
    for _, low, high in reaches:
        for side in free:
            k = side // 2
            beyond = high[k] >= upper[k] if side % 2 else low[k] <= lower[k]
            if k != pressed // 2 and beyond:
                raise BadSetting("body: what presses it reaches beyond it")
    return free


def footprint_of_tool(tool):
    """Side from which a tool presses, and the corners of what is surely pressed."""
    shape, axis, tip = tool["shape"][0].lower(), tool.get("axis", [0, 0, -1]), tool["tip"]
    if shape not in ("sphere", "cone", "berkovich", "pyramid", "flat"):
        raise BadSetting(f"body: under a {shape} it is not made larger")
    along = max(range(3), key=lambda k: abs(axis[k]))
    reach = tool["radius"][0] if shape == "flat" else 0.0
    return 2 * along + (axis[along] < 0), [x - reach for x in tip], [x + reach for x in tip]


def footprint_of_pressure(one, lower, upper):
    """The same of a pressure on a face."""
    flat = [k for k in range(3) if one["lower"][k] == one["upper"][k]]
    if len(flat) != 1:
        raise BadSetting("body: a pressure on all surface in a box")
    k = flat[0]
    return (
        2 * k + (abs(one["lower"][k] - upper[k]) < abs(one["lower"][k] - lower[k])),
        one["lower"],
        one["upper"],
    )


def grow_body(scene, which, body, box, ends, moves):
    """One body: those of its sides move that are outermost."""
    near = 1e-9 * max(high - low for low, high in zip(*ends))
    out = [0.0] * 6
    for axis in range(3):
        for high in (0, 1):
            if abs(box[high][axis] - ends[high][axis]) <= near:
                out[2 * axis + high] = moves[2 * axis + high]
    if body["shape"][0].lower() == "box":
        scene.set("body", "lower", [x - m for x, m in zip(box[0], out[::2])], which)
        scene.set("body", "upper", [x + m for x, m in zip(box[1], out[1::2])], which)
        return
    scene.set("body", "radius", body["radius"][0] + max(out[:4]), which)
    scene.set("body", "height", body["height"][0] + out[4] + out[5], which)
    x, y, z = body["center"]
    base = out[4] if body.get("axis", [0, 0, 1])[2] > 0 else -out[5]
    scene.set("body", "center", [x, y, z - base], which)


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
    most = max(fewest_placed, math.ceil(8 * share * math.prod(cells)))
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


def add_probes(scene, point):
    """Eight probes about a point (on sides of symmetry: beside it), in the middles of the particles around it
    when it is a node of the grid. Names p0 to p7."""
    case = scene.values()
    grid, cell = case["grid"][0], case["grid"][0]["cell_size"][0]
    levels = [one for one in case.get("level", []) if "upper" in one]
    inside = [
        all(
            low - 1e-9 * cell <= x <= high + 1e-9 * cell
            for low, x, high in zip(one["lower"], point, one["upper"])
        )
        for one in levels
    ]
    cell *= 0.5 ** sum(inside)
    a_side = round(int(case["body"][0].get("particles_per_cell", [8])[0]) ** (1 / 3))
    off = cell / (2 * a_side)
    for corner in range(8):
        place = []
        for i, x in enumerate(point):
            sign = 1 if corner >> i & 1 else -1
            at_low, at_high = abs(x - grid["lower"][i]) < 1e-6 * cell, abs(x - grid["upper"][i]) < 1e-6 * cell
            place.append(float(f"{x + (off if at_low else -off if at_high else sign * off):.12g}"))
        scene.add("probe", name=f"p{corner}", position=place)
