"""A body made larger where a half-space would go on: what its ends do to an answer."""

import math

from .scene_text import BadSetting, is_flat


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
    for side in symmetric:
        if side // 2 == 1 and is_flat(values["grid"][0]):
            continue
        low, high = (values["grid"][0][name][side // 2] for name in ("lower", "upper"))
        gap = high - upper[side // 2] if side % 2 else lower[side // 2] - low
        if gap > 1e-6 * (high - low):
            name = "xyz"[side // 2] + "-+"[side % 2]
            raise BadSetting(f"body: it does not reach the side of symmetry {name}")
    if pressed ^ 1 in symmetric:
        raise BadSetting("body: the side opposite the pressed one is one of symmetry")
    if pressed < 4 and any(body["shape"][0].lower() == "cylinder" for body in bodies):
        raise BadSetting("body: a cylinder that is pressed from the side")
    free = [side for side in range(6) if side != pressed and side not in symmetric]
    if all(side // 2 == pressed // 2 for side in free):
        raise BadSetting("body: its pressed face has no free side beside it")
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
