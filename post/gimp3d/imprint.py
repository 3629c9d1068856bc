"""The imprint of a tool in the particles of a run: the surface around it, pile-up or sink-in, the pressure
under it.

Heights are above the undeformed surface, against the tool's axis; places are distances along two directions
across the axis, from it."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.optimize import least_squares
from scipy.spatial import cKDTree

from . import indentation
from .run_data import depth_of

# Of a particle's width: what a contact's radius is off on exact surfaces (Hertz, Sneddon, a wedge), 6 to 16
# particles wide
edge_resolution = 0.15

# Of a cell: half width of the hat with which the gap beside a contact's edge is smoothed, for a grid does not
# bend within a cell as sharply as the surface beside a lip (theory.md, eq. contact-edge)
rounded = 0.5

# Between the middle of a pyramid's face and its edge, for contact_area
sectors = 4


class NoSurface(Exception):
    """The surface cannot be said; the text is a sentence that says why."""


@dataclass
class Frame:
    """Directions of an indentation: `up` against the tool's axis, `through` and `across` beside it (unit
    vectors); `origin`, a point of the axis on the undeformed surface (m)."""

    up: np.ndarray
    through: np.ndarray
    across: np.ndarray
    origin: np.ndarray


@dataclass
class Surface:
    """Points of a body's surface: places (n x 2, m, along through and across), heights (n, m), half widths of
    the particles below them (n, m), and the pressures there (n, Pa): `stress` normal to the surface that was,
    `contact` of the contact itself; width of the grid's finest cells (m)."""

    places: np.ndarray
    heights: np.ndarray
    half_widths: np.ndarray
    stress: np.ndarray
    contact: np.ndarray
    cell: float

    @property
    def radii(self):
        return np.hypot(self.places[:, 0], self.places[:, 1])


def frame_of(case, tool, history):
    """The frame of a tool, and the body it is pressed into, whose surface must be flat across its axis: a box
    along the grid, or a cylinder along the axis, also below a &cut that is a box. A pyramid's `through` is the
    middle of its first face. Raises NoSurface."""
    axis = indentation.unit_axis(tool)
    body, gap = indentation.indented_body(case, tool, history)
    along = int(np.argmax(np.abs(axis)))
    shape = body["shape"][0]
    flat = shape == "box" and abs(axis[along]) > 1 - 1e-9
    if shape == "cylinder":
        own = np.array(body.get("axis", [0.0, 0.0, 1.0]))
        flat = abs(np.dot(own, axis)) > (1 - 1e-9) * np.linalg.norm(own)
    cuts = [cut for cut in case.get("cut", []) if cut["body"] == body.get("name")]
    if flat and any(cut["shape"][0].lower() != "box" for cut in cuts):
        raise NoSurface(
            "whether the surface of a body with a &cut other than a box is flat across the tool's axis is not "
            "known, so no height above it is given"
        )
    if shape not in indentation.known_shapes:
        raise NoSurface(
            f"whether the surface of a body with shape='{shape}' is flat across the tool's axis is not known, "
            "so no height above it is given"
        )
    if not flat:
        raise NoSurface(
            f"the surface of a {shape} is not flat across the tool's axis, so no height above it is given"
        )
    start = np.array(tool["edge"]) if "edge" in tool else np.eye(3)[(along + 1) % 3]
    through = start - np.dot(start, axis) * axis
    through /= np.linalg.norm(through)
    return Frame(-axis, through, np.cross(-axis, through), np.array(tool["tip"]) + gap * axis), body


def symmetric_directions(case, tool):
    """Normals of the symmetry sides in which the tool's axis lies: what the model leaves out is the mirror
    image. None of a section, of which surface_of makes the whole."""
    if is_round(case):
        return []
    grid, axis, tip = case["grid"][0], indentation.unit_axis(tool), np.array(tool["tip"])
    normals = []
    for i in range(3):
        for side, place in enumerate((grid["lower"][i], grid["upper"][i])):
            if (
                grid["boundary"][2 * i + side] == "symmetry"
                and abs(axis[i]) < 1e-9
                and abs(tip[i] - place) < 1e-6 * grid["cell_size"][0]
            ):
                normals.append(np.eye(3)[i])
    return normals


def surface_of(particles, frame, case, body_number, reach, normals=()):
    """The surface within `reach` (m) of the axis: of the particles of a body those that have none above them,
    with the middles of their upper faces. `normals` of symmetry planes through the axis: the mirror images
    are added."""
    relative = particles["position"] - frame.origin
    height = relative @ frame.up
    places = np.stack([relative @ frame.through, relative @ frame.across], axis=1)
    edges = half_edges(particles)
    upwards = np.einsum("nki,i->nk", edges, frame.up)
    steepest = np.argmax(np.abs(upwards), axis=1)
    rows = np.arange(height.size)
    up_edge = edges[rows, steepest] * np.sign(upwards[rows, steepest])[:, None]
    sides = np.linalg.norm(edges, axis=2)
    sides[rows, steepest] = np.inf
    half_width = sides.min(axis=1)
    radii = np.hypot(places[:, 0], places[:, 1])
    own_body = height > -1.5 * reach
    if "body" in particles.fields:
        own_body &= particles["body"].reshape(-1) == body_number
    # Beyond the reach too, by the widest particle: a column that leans has its upper end there
    margin = 2 * float(np.max(half_width[own_body & (radii < reach)], initial=0.0))
    chosen = np.flatnonzero(own_body & (radii < reach + margin))
    if chosen.size == 0:
        raise NoSurface("no particles are near the tool's axis")
    top = height[chosen] + up_edge[chosen] @ frame.up
    at = places[chosen] + np.stack([up_edge[chosen] @ frame.through, up_edge[chosen] @ frame.across], axis=1)
    own = half_width[chosen]
    # A particle lies below the surface where another one is above it: within its half width aside, and higher
    # by half
    # a thickness
    tree = cKDTree(at)
    hidden = np.zeros(chosen.size, dtype=bool)
    thickness = np.abs(up_edge[chosen] @ frame.up)
    for i, others in enumerate(tree.query_ball_point(at, 1.01 * own)):
        hidden[i] = np.any(top[others] > top[i] + thickness[i])
    shown = ~hidden & (np.hypot(at[:, 0], at[:, 1]) < reach)
    if not np.any(shown):
        raise NoSurface("no particles are near the tool's axis")
    stress = -normal_stress(particles.smooth_stress()[chosen[shown]], frame.up)
    contact = (
        particles["contact_pressure"][chosen[shown]].reshape(-1)
        if "contact_pressure" in particles.fields
        else 0 * stress
    )
    cell = case["grid"][0]["cell_size"][0] / 2 ** depth_of(case)
    surface = Surface(at[shown], top[shown], own[shown], stress, contact, cell)
    if is_round(case):
        return revolved(surface)
    for normal in normals:
        image = np.array([np.dot(normal, frame.through), np.dot(normal, frame.across)])
        mirrored = surface.places - 2 * (surface.places @ image)[:, None] * image
        surface = Surface(
            *(
                np.concatenate([a, b])
                for a, b in zip(
                    (surface.places, surface.heights, surface.half_widths, surface.stress, surface.contact),
                    (mirrored, surface.heights, surface.half_widths, surface.stress, surface.contact),
                )
            ),
            cell,
        )
    return surface


def is_round(case):
    """True where the scene is the section of a body of revolution."""
    return case["grid"][0].get("geometry", ["3d"])[0].lower() == "axisymmetric"


def revolved(surface):
    """The surface all around its axis: each ring as points a domain's width apart."""
    radii = np.hypot(surface.places[:, 0], surface.places[:, 1])
    count = np.maximum(6, np.ceil(np.pi * radii / surface.half_widths)).astype(int)
    which = np.repeat(np.arange(count.size), count)
    angle = np.concatenate([2 * np.pi * (np.arange(n) + 0.5 * (i % 2)) / n for i, n in enumerate(count)])
    places = radii[which, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Surface(
        places,
        surface.heights[which],
        surface.half_widths[which],
        surface.stress[which],
        surface.contact[which],
        surface.cell,
    )


def half_edges(particles):
    """Half edges of the particles' domains, n x 3 x 3 (edge, component), m."""
    if "domain" in particles.fields:
        return particles["domain"].reshape(-1, 3, 3)
    size = np.broadcast_to(particles["half_size"].reshape(particles.ids.size, -1), (particles.ids.size, 3))
    return size[:, :, None] * np.eye(3)


def normal_stress(stress, direction):
    """n . sigma . n (Pa) of stresses (n x 6: xx yy zz yz xz xy)."""
    x, y, z = direction
    return stress @ np.array([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y])


@dataclass
class Profile:
    """A surface in rings about the axis: middles (m), mean, lowest and highest height (m), mean pressures
    (Pa) as in Surface."""

    radius: np.ndarray
    mean: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    stress: np.ndarray
    contact: np.ndarray

    def height(self, radius):
        return float(np.interp(radius, self.radius, self.mean))


def radial_profile(surface, reach):
    """Means over rings one particle wide, those near the axis; rings that hold no point are left out."""
    width = 2 * float(
        np.median(
            surface.half_widths[surface.radii <= np.sort(surface.radii)[min(40, surface.radii.size - 1)]]
        )
    )
    ring = (surface.radii / width).astype(int)
    rows = []
    for number in np.unique(ring):
        inside = ring == number
        if (number + 0.5) * width > reach:
            break
        area = surface.half_widths[inside] ** 2
        rows.append(
            (
                np.average(surface.radii[inside], weights=area),
                np.average(surface.heights[inside], weights=area),
                surface.heights[inside].min(),
                surface.heights[inside].max(),
                np.average(surface.stress[inside], weights=area),
                np.average(surface.contact[inside], weights=area),
            )
        )
    if len(rows) < 3:
        raise NoSurface("the imprint is smaller than three particles, too small for a profile")
    return Profile(*(np.array(column) for column in zip(*rows)))


def line(surface, direction, distance):
    """Heights (m) along a line through the axis, in the plane of `direction` (2 components), at distances (m)
    from it; not a number where the surface is not known."""
    direction = np.asarray(direction) / np.linalg.norm(direction)
    # the others are no neighbours of it
    beside = np.abs(surface.places @ np.array([-direction[1], direction[0]])) < 6 * surface.half_widths
    return LinearNDInterpolator(surface.places[beside], surface.heights[beside])(
        np.outer(distance, direction)
    )


def tool_height(tool, places):
    """Height (m) of a tool's surface above its tip at places (n x 2, along the frame's through and across);
    infinite beside it. None for shapes whose surface is not known here."""
    shape = tool["shape"][0]
    r = np.hypot(places[:, 0], places[:, 1])
    if shape in ("sphere", "flat"):
        radius = tool["radius"][0]
        inside = r <= radius
        height = np.full(r.shape, np.inf)
        height[inside] = radius - np.sqrt(radius**2 - r[inside] ** 2) if shape == "sphere" else 0.0
        return height
    if shape not in ("cone", "berkovich", "pyramid"):
        return None
    angle = math.radians(tool["half_angle"][0])
    if shape == "cone":
        across = r
    else:
        faces = 3 if shape == "berkovich" else int(tool["faces"][0])
        turns = 2 * math.pi * np.arange(faces) / faces
        across = np.max(places @ np.stack([np.cos(turns), np.sin(turns)]), axis=1)
    rounding = tool.get("tip_radius", [0.0])[0]
    sharp = across / math.tan(angle) - rounding * (1 / math.sin(angle) - 1)
    ball = rounding - np.sqrt(np.maximum(rounding**2 - r**2, 0.0))
    return np.where(r < rounding * math.cos(angle), ball, np.maximum(sharp, 0.0))


def opening(distance, power):
    """A power of the distance (cells) from a contact's edge, 0 within, smoothed by a hat of the half width
    `rounded`."""
    x, s, q = distance, rounded, power + 2
    return sum(f * np.maximum(x + d, 0.0) ** q for f, d in ((1, s), (-2, 0), (1, -s))) / (s * s * q * (q - 1))


def contact_radius(surface, tool, tip):
    """Radius (m) at which a surface leaves a tool that is round about its axis, and its uncertainty; `tip` is
    the height of the tip (m). The gap between them near the edge is fitted by c (r - a)^q, 0 within a, as the
    grid shows it (opening), with q between 1 (the wedge beside pile-up) and 3/2 (beside an elastic contact,
    Johnson 1985), over a cell within and two outside. What one and a half and three outside give instead is
    its uncertainty, with edge_resolution of a particle. None where no gap opens, or no contact is seen."""
    if tool["shape"][0] not in ("sphere", "cone"):
        return None
    gap = tip + tool_height(tool, surface.places) - surface.heights
    order = np.argsort(surface.radii)
    radius, gap, width = surface.radii[order], gap[order], 2 * surface.half_widths[order]
    known = np.isfinite(gap)
    radius, gap, width = radius[known], gap[known], width[known]

    def flank(r):
        return tool_height(tool, np.stack([r, 0 * r], axis=1))

    rise = flank(radius) - flank(np.maximum(radius - width, 0.0))  # of the tool over a particle
    apart = gap > 0.1 * np.minimum(rise, width)
    # the edge is where all are apart for one and a half particles, and none touch beyond; some hover within
    beyond = np.searchsorted(radius, radius + 1.5 * width)
    counted = np.r_[0, np.cumsum(apart)]
    rows = np.arange(radius.size)
    share = (counted[beyond] - counted[rows]) / np.maximum(beyond - rows, 1)
    touched = np.flatnonzero((share < 0.5) & (beyond < radius.size))
    open_ = apart & (share > 0.95) & (beyond < radius.size) & (rows > (touched[-1] if touched.size else -1))
    if not np.any(open_) or radius[np.argmax(open_)] < 2 * width[np.argmax(open_)]:
        return None
    first, unit = float(radius[np.argmax(open_)]), float(width[np.argmax(open_)])

    def edge_of(outside):
        near = (radius > first - surface.cell) & (radius < first + outside * surface.cell)
        r, g = (radius[near] - first) / surface.cell, gap[near] / surface.cell
        if r.size < 8:
            return None
        found = least_squares(
            lambda x: x[1] * opening(r - x[0], x[2]) - g,
            [-0.15, max(float(g.max()) / outside, 1e-6), 1.25],
            bounds=([-1.0, 0.0, 1.0], [1.0, np.inf, 1.5]),
            x_scale=[1, max(float(g.max()), 1e-6), 1],
        )
        return first + found.x[0] * surface.cell

    edges = [edge for edge in map(edge_of, (2, 1.5, 3)) if edge is not None]
    if not edges:
        return None
    return edges[0], math.hypot(
        max((abs(edge - edges[0]) for edge in edges[1:]), default=unit / 2), edge_resolution * unit
    )


def contact_area(surface, tool, tip):
    """Area (m2) within which a surface touches a tool, its uncertainty, and the distance from the axis at
    which the contact ends (m; of a pyramid across its faces, mean of the sectors), with its uncertainty. Of a
    pyramid the edge is sought in sectors between the middle of a face and the edge of two, all faces
    together. None where contact_radius finds none, be it in one sector, and for tools of other shapes."""
    if tool["shape"][0] not in ("berkovich", "pyramid"):
        found = contact_radius(surface, tool, tip)
        return found and (math.pi * found[0] ** 2, 2 * math.pi * found[0] * found[1], *found)
    faces = 3 if tool["shape"][0] == "berkovich" else int(tool["faces"][0])
    turn = np.mod(np.arctan2(surface.places[:, 1], surface.places[:, 0]), 2 * math.pi / faces)
    turn = np.minimum(turn, 2 * math.pi / faces - turn)
    across = surface.radii * np.cos(turn)
    flank = {**tool, "shape": ["cone"]}  # what the tool is along a face
    bounds = np.linspace(0.0, math.pi / faces, sectors + 1)
    # of the area within the distance a across the faces: a^2 times these
    weights = faces * np.diff(np.tan(bounds))
    edges = []
    for low, high in zip(bounds, bounds[1:]):
        inside = (turn >= low) & (turn <= high)
        part = Surface(
            np.stack([across[inside], 0 * across[inside]], axis=1),
            *(a[inside] for a in (surface.heights, surface.half_widths, surface.stress, surface.contact)),
            surface.cell,
        )
        edges.append(contact_radius(part, flank, tip))
        if edges[-1] is None:
            return None
    edge, sigma = np.array(edges).T
    # the sectors lie on the same cells: what one is off by, the others may be too
    area, area_sigma = float(weights @ edge**2), float(2 * weights @ (edge * sigma))
    mean = math.sqrt(area / weights.sum())
    return area, area_sigma, mean, area_sigma / (2 * weights.sum() * mean)


def pile_up(profile, edge, depth):
    """Height (m) of the surface at the edge of the contact: above 0 pile-up, below 0 sink-in, and its
    uncertainty: how much it changes over half a ring either way. Also the highest mean height outside the
    edge, and where."""
    if not profile.radius[0] < edge < profile.radius[-1]:
        raise NoSurface("the edge of the contact lies outside the known surface")
    i = int(np.searchsorted(profile.radius, edge))
    width = float(profile.radius[i] - profile.radius[i - 1])
    value = profile.height(edge)
    sigma = 0.5 * abs(profile.height(edge + width / 2) - profile.height(edge - width / 2))
    outside = np.flatnonzero(profile.radius >= edge - width)
    peak = outside[int(np.argmax(profile.mean[outside]))]
    return value, sigma, float(profile.mean[peak]), float(profile.radius[peak])
