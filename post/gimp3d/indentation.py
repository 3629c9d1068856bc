"""The facts of an indentation: the modelled share of the body, where the surface is, half-space theory,
references."""

import math

import numpy as np

from .run_data import Unreadable


def share_of_body(history):
    """The part of the body that a scene models, as the head of the tool's history says: a symmetry plane
    through its axis halves it."""
    if "model_share" not in history.notes:
        raise Unreadable("the tool's history does not say its model_share")
    return float(history.notes["model_share"])


def kinetic_share(energy, first, last):
    """Largest kinetic energy between two times (s), as a share of the most that loads had done by then or of
    the strain energy, whichever is larger; None where neither is above 0. A quasi-static load has less than
    0.01. What an elastic unloading gives back counts as work done."""
    work = np.maximum.accumulate(np.abs(energy["external_work"]))
    work = np.maximum(work, energy.columns.get("strain", 0.0))
    used = (energy["time"] >= first) & (energy["time"] <= last) & (work > 0)
    return float(np.max(energy["kinetic"][used] / work[used])) if np.any(used) else None


def unit_axis(tool):
    axis = np.array(tool.get("axis", [0.0, 0.0, -1.0]))
    return axis / np.linalg.norm(axis)


def entry_of(body, tip, axis):
    """Where the straight line from a tip along a unit axis enters a box, sphere or cylinder: its distance
    from the tip (m), below 0 where the tip is inside; None where it passes by, or where all of the body is
    behind the tip. A body that it only touches counts as met."""
    shape, low, high = body["shape"][0].lower(), -math.inf, math.inf
    if shape == "box":
        size = np.subtract(body["upper"], body["lower"])
        spans = [(np.subtract(body["lower"], tip)[i], size[i], axis[i]) for i in range(3)]
        rounds = []
    elif shape == "sphere":
        spans, rounds = [], [(np.subtract(tip, body["center"]), axis)]
    else:
        own = np.array(body.get("axis", [0.0, 0.0, 1.0]))
        own = own / np.linalg.norm(own)
        away = np.subtract(tip, body["center"])
        spans = [(-np.dot(away, own), body["height"][0], np.dot(axis, own))]
        rounds = [(away - np.dot(away, own) * own, axis - np.dot(axis, own) * own)]
    for start, length, speed in spans:  # start to start + length along one direction, at `speed`
        slack = 1e-9 * length
        if abs(speed) < 1e-12:
            if not -slack <= -start <= length + slack:
                return None
            continue
        ends = sorted((start / speed, (start + length) / speed))
        low, high = max(low, ends[0]), min(high, ends[1])
    for away, way in rounds:  # within a radius
        radius, square = body["radius"][0], np.dot(way, way)
        if square < 1e-24:
            if np.linalg.norm(away) > radius * (1 + 1e-9):
                return None
            continue
        half, rest = np.dot(away, way), np.dot(away, away) - radius**2
        under = half**2 - square * rest
        if under < -1e-9 * square * radius**2:
            return None
        root = math.sqrt(max(under, 0.0))
        low, high = max(low, (-half - root) / square), min(high, (-half + root) / square)
    return low if low <= high + 1e-9 * abs(high) and high > 0 else None


def front_of(body, axis):
    """How far towards a tool a box, sphere or cylinder reaches: its least coordinate along the axis (m)."""
    shape = body["shape"][0].lower()
    if shape == "box":
        corners = np.array([body["lower"], body["upper"]])
        return sum(min(corners[:, i] * axis[i]) for i in range(3))
    if shape == "sphere":
        return np.dot(body["center"], axis) - body["radius"][0]
    own = np.array(body.get("axis", [0.0, 0.0, 1.0]))
    own = own / np.linalg.norm(own)
    ends = np.array([body["center"], body["center"] + own * body["height"][0]]) @ axis
    return min(ends) - body["radius"][0] * math.sqrt(max(0.0, 1 - np.dot(own, axis) ** 2))


known_shapes = "box", "sphere", "cylinder"


def indented_body(case, tool, history):
    """The body that a tool is pressed into, and the gap between its tip and that body's surface at the start
    (m): the first that the tool's axis meets, as the head of the tool's history says. Of runs before this was
    written, and where the axis meets no body (then the one that reaches furthest towards the tool): computed,
    if all bodies are boxes, spheres and cylinders without a &cut. Raises Unreadable where it is not known."""
    try:
        number = int(history.notes.get("indented_body", -1))
        if number > 0:
            return case["body"][number - 1], float(history.notes["surface_gap"])
    except (KeyError, IndexError, ValueError):
        raise Unreadable("the head of the tool's history lacks indented_body or surface_gap") from None
    shapes = {body["shape"][0].lower() for body in case["body"]}
    if "cut" in case or not shapes <= set(known_shapes):
        raise Unreadable(
            "where the surface below the tool is, is not known: "
            + (
                "its axis meets no body, and bodies have a &cut or another shape than box, sphere, cylinder; "
                "its travel is the column depth of its history"
                if number == 0
                else "bodies have a &cut or another shape than box, sphere, cylinder, and the history of the "
                "tool is of a version that does not say it; run the scene again"
            )
        )
    axis, tip = unit_axis(tool), np.array(tool["tip"])
    met = [(entry_of(body, tip, axis), n) for n, body in enumerate(case["body"])]
    met = [one for one in met if one[0] is not None]
    if not met:
        met = [(front_of(body, axis) - np.dot(tip, axis), n) for n, body in enumerate(case["body"])]
    gap, n = min(met)
    return case["body"][n], gap


def half_space_theory(case, tool, history):
    """Name and load(depth) (N, m) of the elastic half-space under this tool, frictionless; None for other
    tools and laws, and for a punch that is as wide as the body, or whose body has no known width."""
    body, _ = indented_body(case, tool, history)
    material = next(m for m in case["material"] if m["name"] == body["material"])
    if "young" not in material:
        return None  # not an isotropic law
    modulus = material["young"][0] / (1 - material["poisson"][0] ** 2)
    shape = tool["shape"][0]
    if shape == "sphere":
        radius = tool["radius"][0]
        return "Hertz (half-space)", lambda d: 4 / 3 * modulus * math.sqrt(radius) * np.maximum(d, 0) ** 1.5
    if shape == "cone" and tool.get("tip_radius", [0.0])[0] > 0:
        return "Briscoe (half-space)", rounded_cone(
            modulus, math.radians(tool["half_angle"][0]), tool["tip_radius"][0]
        )
    if shape == "cone":
        slope = math.tan(math.radians(tool["half_angle"][0]))
        return "Sneddon (half-space)", lambda d: 2 / math.pi * modulus * slope * np.maximum(d, 0) ** 2
    if shape == "flat":
        radius = tool["radius"][0]
        if body["shape"][0].lower() not in known_shapes:
            return None
        width = (
            body["radius"][0] if "radius" in body else 0.5 * max(np.subtract(body["upper"], body["lower"]))
        )
        if radius >= width:
            return None
        return "flat punch (half-space)", lambda d: 2 * radius * modulus * np.maximum(d, 0)
    return None


def rounded_cone_depth(half_angle, share):
    """Depth of a rounded cone over its tip's radius where the contact has `share` times the radius of the
    circle in which its sphere touches it, 1 or more (Briscoe 1994)."""
    b = math.cos(half_angle)
    a = share * b
    return a * (a - math.sqrt(a * a - b * b)) + a / math.tan(half_angle) * (math.pi / 2 - math.asin(b / a))


def rounded_cone(modulus, half_angle, tip_radius):
    """load(depth) (N, m) of an elastic half-space of plane-strain modulus E' (Pa) under a rigid cone whose
    tip is a sphere of a radius (m) that touches it (Briscoe, Sebastian and Adams 1994). Up to the contact
    radius R cos(half_angle) it is Hertz's."""
    b, slope = tip_radius * math.cos(half_angle), 1 / math.tan(half_angle)

    def beyond(a):
        """Depth and load at contact radii of at least b."""
        root, arc = np.sqrt(a**2 - b**2), math.pi / 2 - np.arcsin(b / a)
        depth = a / tip_radius * (a - root) + a * slope * arc
        load = (
            2
            * modulus
            * (
                a * depth
                - a**2 / 2 * slope * arc
                - a**3 / (3 * tip_radius)
                + root * (b / 2 * slope + (a**2 - b**2) / (3 * tip_radius))
            )
        )
        return depth, load

    def load(depth):
        depth = np.maximum(depth, 0)
        radii = b * np.geomspace(1, max(2, 4 * np.max(depth) / (b * slope) + 2), 4000)
        return np.where(
            depth <= b**2 / tip_radius,
            4 / 3 * modulus * math.sqrt(tip_radius) * depth**1.5,
            np.interp(depth, *beyond(radii)),
        )

    return load


def read_reference(path):
    """Depth (m) and load of the full body (N) of a finite-element reference: a .csv with the names of its
    columns in the comment line before the first row."""
    try:
        lines = path.read_text().splitlines()
        first = next(i for i, line in enumerate(lines) if line and line[0] != "#")
        names = [name.strip() for name in lines[first - 1].lstrip("# ").split(",")]
        rows = np.array(
            [[float(word) for word in line.split(",")] for line in lines if line and line[0] != "#"]
        )
        return rows[:, names.index("depth_um")] * 1e-6, rows[:, names.index("load_full_uN")] * 1e-6
    except (OSError, ValueError, IndexError, StopIteration) as error:
        raise Unreadable(f"{path}: not a reference curve ({error})")


def tool_outline(tool, width):
    """The tool's profile in its own section: distance from the axis (0 to width) and height above the tip."""
    r = np.linspace(0, width, 400)
    shape = tool["shape"][0]
    if shape == "sphere":
        radius = tool["radius"][0]
        r = np.linspace(0, min(width, radius), 400)
        return r, radius - np.sqrt(radius**2 - r**2)
    if shape == "cone":
        angle, tip = math.radians(tool["half_angle"][0]), tool.get("tip_radius", [0.0])[0]
        touches = tip * math.cos(angle)  # where the sphere goes over into the cone
        cap = tip - np.sqrt(np.maximum(0.0, tip**2 - r**2))
        return r, np.where(r < touches, cap, (r - touches) / math.tan(angle) + tip * (1 - math.sin(angle)))
    if shape == "flat":
        radius = tool["radius"][0]
        return np.array([0, radius, radius]), np.array([0, 0, width])
    return None
