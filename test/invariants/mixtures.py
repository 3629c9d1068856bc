"""Small scenes made by chance of all parts together: contact groups with holes, implicit steps, levels that the
error places, crystals in grains, files. A scene is a list of groups whose values know how they turn, so that it
can be seen in any way that keeps the grid: mirrored along x, or turned about z by a right angle."""

import copy
import math
import random

import numpy as np
from scenes import CELL, DENSITY, EDGE, YOUNG, number, point

SIDES = [(axis, side) for axis in range(3) for side in (0, 1)]  # x- x+ y- y+ z- z+
MIRROR = np.diag([-1.0, 1.0, 1.0])
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


HARDENING = 0.02  # modulus of metals, of Young's
HOLLOW = -1  # a seed: two boxes of contact groups, one with a round hole


class Vector:
    """A place or a direction."""

    def __init__(self, *values):
        self.values = np.array(values, float)

    def turn(self, m):
        self.values = m @ self.values + 0.0

    def text(self):
        return point(self.values)


class Axial(Vector):
    """An angular velocity."""

    def turn(self, m):
        self.values = np.linalg.det(m) * (m @ self.values) + 0.0


class Sides:
    """Words for the sides of the grid."""

    def __init__(self, words):
        self.words = list(words)

    def turn(self, m):
        words = list(self.words)
        for (axis, side), word in zip(SIDES, self.words):
            along = int(np.argmax(np.abs(m[:, axis])))
            words[2 * along + (side if m[along, axis] > 0 else 1 - side)] = word
        self.words = words

    def text(self):
        return ",".join(f"'{word}'" for word in self.words)


class Grains:
    """Seeds and Euler angles (phi1 Phi phi2), as a file has them."""

    def __init__(self, seeds, angles, name):
        self.seeds, self.angles, self.name = np.array(seeds), np.array(angles), name

    def turn(self, m):
        self.seeds = self.seeds @ m.T
        # a cubic crystal is its own mirror image
        of_crystal = m if np.linalg.det(m) < 0 else np.eye(3)
        self.angles = np.array([angles_of(m @ matrix_of(a) @ of_crystal) for a in self.angles])

    def write(self, folder):
        rows = np.hstack([self.seeds, self.angles])
        (folder / self.name).write_text("\n".join(" ".join(f"{x:.15g}" for x in row) for row in rows) + "\n")

    def text(self):
        return f"'FOLDER/{self.name}'"


class Surface:
    """Triangles as an STL file has them."""

    def __init__(self, triangles, name):
        self.triangles, self.name = np.array(triangles, float), name

    def turn(self, m):
        self.triangles = self.triangles @ m.T + 0.0
        if np.linalg.det(m) < 0:
            self.triangles = self.triangles[:, ::-1]

    def write(self, folder):
        lines = ["solid a"]
        for corners in self.triangles:
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += [f"vertex {x:.15g} {y:.15g} {z:.15g}" for x, y, z in corners]
            lines += ["endloop", "endfacet"]
        (folder / self.name).write_text("\n".join([*lines, "endsolid a"]) + "\n")

    def text(self):
        return f"'FOLDER/{self.name}'"


def matrix_of(angles):
    """From the axes of the crystal to those of the sample, by Bunge's angles in degrees."""
    (c1, c, c2), (s1, s, s2) = np.cos(np.radians(angles)), np.sin(np.radians(angles))
    return np.array(
        [
            [c1 * c2 - s1 * s2 * c, -c1 * s2 - s1 * c2 * c, s1 * s],
            [s1 * c2 + c1 * s2 * c, -s1 * s2 + c1 * c2 * c, -c1 * s],
            [s2 * s, c2 * s, c],
        ]
    )


def angles_of(g):
    phi = math.acos(max(-1.0, min(1.0, g[2, 2])))
    return np.degrees([math.atan2(g[0, 2], -g[1, 2]), phi, math.atan2(g[2, 0], g[2, 1])])


def solid(points, faces):
    """Triangles of a convex body from its corners and faces, all outwards."""
    points, middle = np.array(points, float), np.mean(points, axis=0)
    found = []
    for face in faces:
        for b, c in zip(face[1:], face[2:]):
            t = points[[face[0], b, c]]
            out = np.cross(t[1] - t[0], t[2] - t[0]) @ (t[0] - middle)
            found.append(t if out > 0 else t[::-1])
    return found


def pyramid(corners, angle, height, start):
    """A tip that stands on its point, in its origin."""
    wide = height * math.tan(math.radians(angle))
    turn = [start + 2 * math.pi * k / corners for k in range(corners)]
    points = [(0, 0, 0)] + [(wide * math.cos(t), wide * math.sin(t), height) for t in turn]
    sides = [(0, 1 + k, 1 + (k + 1) % corners) for k in range(corners)]
    return solid(points, [*sides, tuple(range(1, corners + 1))])


def frustum(low, high, height):
    """A body with a square foot and a square top, above its origin."""
    points = [(x * w, y * w, z) for z, w in ((0, low), (height, high)) for x in (-1, 1) for y in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    return solid(points, faces)


class Mixture:
    """A scene from a seed; the same everywhere. Lengths are drawn in cells and stand here in m."""

    def __init__(self, seed):
        self.seed = seed
        self.chance = chance = random.Random(f"mixture {seed}")
        self.family = chance.choice(
            ["groups", "groups", "implicit", "implicit", "error", "crystal", "file", "file"]
        )
        self.per_cell = chance.choice([1, 8, 8, 8])
        self.domain = chance.choice(["fixed", "stretch", "corners", "corners"])
        self.transfer, self.flip, self.update = chance.choice(["affine", "affine", "plain"]), 1, "usl"
        self.groups, self.files, self.tools, self.bodies, self.levels = [], [], [], [], []
        self.law = chance.choice(["elastic", "elastic", "neo_hookean", "j2"])
        self.poisson = chance.choice([0.0, 0.3, 0.3, 0.4])
        self.gravity, self.exact_end, self.strain, self.free = None, None, 0.0, False
        self.quarter = self.implicit = False
        self.rubs = self.branches = False
        if seed == HOLLOW:
            self.family, self.per_cell, self.domain, self.transfer = "groups", 8, "fixed", "plain"
            self.law, self.poisson = "elastic", 0.3
        self.end = 200 * 0.3 * CELL / self.wave()
        if seed == HOLLOW:
            self.make_hollow()
        else:
            getattr(self, f"make_{self.family}")()
        if self.tools:
            self.rubs = self.rubs or any("friction" in tool for tool in self.tools)

    # what there is

    def wave(self):
        nu = self.poisson
        return math.sqrt(YOUNG / DENSITY * (1 - nu) / (1 + nu) / (1 - 2 * nu))

    def add(self, kind, **values):
        self.groups.append((kind, values))
        return values

    def add_material(self, name="stuff"):
        values = {
            "name": name,
            "model": self.law,
            "density": DENSITY,
            "young": YOUNG,
            "poisson": self.poisson,
        }
        if self.law == "j2":
            yields = YOUNG * 10 ** self.chance.uniform(-2.5, -1.3)
            values |= {"yield_stress": yields, "hardening_modulus": HARDENING * YOUNG}
        if self.law == "crystal":
            del values["young"], values["poisson"]
            tau = YOUNG * 10 ** self.chance.uniform(-3, -2)
            values |= {"c11": 1.7 * YOUNG, "c12": 1.24 * YOUNG, "c44": 0.75 * YOUNG, "tau0": tau}
            values |= {"tau_s": 3 * tau, "h0": 4 * tau, "reference_rate": 0.2, "rate_sensitivity": 0.05}
            values |= {"q": 1.4, "hardening": "kalidindi", "hardening_exponent": 2.25}
        return self.add("material", **values)

    def add_box(self, lower, size, **more):
        body = self.add(
            "body",
            material="stuff",
            shape="box",
            lower=Vector(*(CELL * x for x in lower)),
            upper=Vector(*(CELL * (x + s) for x, s in zip(lower, size))),
            particles_per_cell=self.per_cell,
            **more,
        )
        self.bodies.append(body)
        return body

    def pieces(self, low, high):
        """A length between two numbers of cells, of whole particles."""
        edge = EDGE[self.per_cell]
        return self.chance.randint(math.ceil(low / edge), math.floor(high / edge)) * edge

    def add_grid(self, lower, upper, words):
        self.add(
            "grid",
            lower=Vector(*(CELL * x for x in lower)),
            upper=Vector(*(CELL * x for x in upper)),
            cell_size=CELL,
            boundary=Sides(words),
        )

    def add_block(self, low=3, high=4.5):
        """A block on a foot that holds it: its size."""
        chance = self.chance
        size = [self.pieces(low, high) for _ in range(3)]
        words = ["free"] * 4 + [chance.choice(["fixed", "fixed", "symmetry"]), "free"]
        if words[4] == "symmetry" or chance.random() < 0.3:
            words[0] = words[2] = "symmetry"
        self.add_grid(
            [-3 * (words[0] == "free")] * 2 + [0], [math.ceil(size[0]) + 3, math.ceil(size[1]) + 3, 9], words
        )
        shift = [chance.choice([0.0, 0.5, chance.random()]) if words[0] == "free" else 0.0 for _ in range(2)]
        self.add_material()
        self.add_box([*shift, 0], size)
        return [s + x for s, x in zip(shift, size)] + [size[2]], words[0] == "symmetry"

    def add_tool(self, top, at_planes, depth, time, **more):
        """A tool that goes in, and stands or comes back."""
        chance = self.chance
        tip = [0.0 if at_planes else chance.uniform(0.3, 0.7) * top[a] for a in range(2)]
        tool = {"name": "t0", "shape": chance.choice(["sphere", "cone", "flat", "wedge", "berkovich"])}
        tool |= {"tip": Vector(*(CELL * x for x in tip), CELL * (top[2] + 0.01)), "axis": Vector(0, 0, -1)}
        tool |= more
        if tool["shape"] in ("wedge", "berkovich") and "edge" not in tool:
            tool["edge"] = Vector(*chance.choice([(1, 0, 0), (0, 1, 0)]))
        if tool["shape"] == "berkovich" and at_planes:
            tool["shape"] = "cone"
            del tool["edge"]
        if tool["shape"] in ("cone", "wedge"):
            tool["half_angle"] = chance.choice([60, 70.3])
        if tool["shape"] in ("sphere", "flat"):
            tool["radius"] = chance.uniform(1.5, 4) * CELL
        speed = depth * CELL / (0.7 * time)
        if chance.random() < 0.4:
            tool["friction"] = 0.3
        tool |= {
            "times": [0, 0.1 * time, 0.7 * time, 0.8 * time],
            "speeds": [0, speed, speed, chance.choice([0, -speed])],
        }
        if self.implicit:
            tool |= {"times": [0, 0.6 * time], "speeds": [speed, chance.choice([0, -speed])]}
        self.tools.append(tool)
        self.add("tool", **tool)

    # families

    def make_groups(self):
        """Two boxes that meet or lie on each other, often hollow; free, or on a foot."""
        chance = self.chance
        self.add_material()
        self.free = chance.random() < 0.6
        size = [[self.pieces(2, 4) for _ in range(3)] for _ in range(2)]
        low = [0.5 * chance.randint(0, 2), 0.5 * chance.randint(0, 2), 0.0]
        high = [low[a] + 0.5 * chance.randint(-1, 2) for a in range(2)] + [size[0][2]]
        gap = chance.choice([0.0, 0.0, 0.05])
        speed = 10 ** chance.uniform(-2.5, -1.3) * self.wave()
        side = 0.3 * speed * chance.uniform(-1, 1)
        self.add_grid(
            [-4, -4, -4 if self.free else 0],
            [9, 9, 12],
            ["free"] * 4 + ["free" if self.free else "fixed", "free"],
        )
        first = {"velocity": Vector(side, 0.5 * side, speed)} if self.free else {}
        if self.free and chance.random() < 0.3:
            first["angular_velocity"] = Axial(*(0.3 * speed / CELL * chance.uniform(-1, 1) for _ in range(3)))
        self.add_box(low, size[0], name="a", contact_group="a", **first)
        self.add_box(
            [*high[:2], high[2] + gap], size[1], name="b", contact_group="b", velocity=Vector(0, 0, -speed)
        )
        for name, lower, of in (("a", low, size[0]), ("b", high, size[1])):
            if chance.random() < 0.4:
                middle = Vector(*(CELL * (x + chance.choice([0.5, 0.5, 0.6]) * s) for x, s in zip(lower, of)))
                self.add(
                    "cut", body=name, shape="sphere", center=middle, radius=CELL * chance.uniform(0.5, 0.9)
                )
        friction = chance.choice([0, 0.3])
        contact = {"friction": friction}
        if chance.random() < 0.3:
            contact |= {
                "bond_strength": YOUNG * 10 ** chance.uniform(-3, -1.5),
                "adhesion": YOUNG * CELL * 1e-5,
            }
        self.rubs = friction > 0 or "adhesion" in contact
        self.add("body_contact", **contact)

    def make_hollow(self):
        """Two boxes that meet, one hollow, with faces on planes of nodes."""
        self.add_material()
        self.free = True
        self.add_grid([-3, -3, -3], [6, 6, 8], ["free"] * 6)
        speed = 0.024 * self.wave()
        self.add_box(
            [0.5, 0.5, 0], [3, 2.5, 2], name="a", contact_group="a", velocity=Vector(0.2 * speed, 0, speed)
        )
        self.add_box([0.5, 0.5, 2], [2, 2, 2.5], name="b", contact_group="b", velocity=Vector(0, 0, -speed))
        middle = Vector(*(CELL * x for x in (2, 1.75, 1)))
        self.add("cut", body="a", shape="sphere", center=middle, radius=0.6 * CELL)
        self.add("body_contact", friction=0)

    def make_implicit(self):
        """A block under a tool or a pressure, by quasi-static steps or implicit ones with inertia."""
        chance = self.chance
        self.implicit, self.end = True, 1.0
        top, at_planes = self.add_block()
        mode = chance.choice(["static", "static", "newmark"])
        self.static = mode == "static"
        step = {"step": 0.1, "max_step": 0.1, "mode": mode}
        if mode == "newmark":
            step["theta"] = chance.choice([0.5, 1.0])
        if chance.random() < 0.6:
            self.add_tool(top, at_planes, chance.uniform(0.3, 0.8), self.end)
        else:
            self.add_pressure(10 ** chance.uniform(-3, -1.5) * chance.choice([-1, 1]))
        self.add("quasi_static", **step)

    def add_pressure(self, share):
        self.branches = self.law == "j2" and share > HARDENING
        lower, upper = self.bodies[0]["lower"].values.copy(), self.bodies[0]["upper"].values.copy()
        lower[2] = upper[2]
        self.add(
            "pressure",
            lower=Vector(*lower),
            upper=Vector(*upper),
            times=[0, 0.5 * self.end],
            values=[0, share * YOUNG],
        )

    def make_error(self):
        """A level that the error places, under a tool or a pressure."""
        chance = self.chance
        top, at_planes = self.add_block(3, 4)
        self.add("level", criterion="error", max_cells=chance.choice([6000, 12000]), tolerance=0.1)
        self.levels.append(True)
        self.add_tool(top, at_planes, chance.uniform(0.3, 0.8), self.end)

    def make_crystal(self):
        """Grains of a file in a block under a pressure or a tool."""
        chance = self.chance
        self.law, self.domain = "crystal", "corners"
        top, at_planes = self.add_block()
        box = self.bodies[0]
        low, high = box["lower"].values, box["upper"].values
        seeds = [[chance.uniform(a, b) for a, b in zip(low, high)] for _ in range(chance.choice([1, 5, 12]))]
        angles = [[chance.uniform(0, 360), chance.uniform(5, 175), chance.uniform(0, 360)] for _ in seeds]
        grains = Grains(seeds, angles, "grains.txt")
        self.files.append(grains)
        self.add("grains", lower=Vector(*low), upper=Vector(*high), file=grains)
        if chance.random() < 0.5:
            self.add_tool(top, at_planes, chance.uniform(0.3, 0.6), self.end)
        else:
            self.add_pressure(10 ** chance.uniform(-3, -2) * chance.choice([-1, 1]))

    def make_file(self):
        """A tip of an STL file in a block, or a body of one under a tool."""
        chance = self.chance
        if chance.random() < 0.5:
            top, at_planes = self.add_block()
            tip = pyramid(chance.choice([3, 4, 6]), chance.choice([50, 65]), 3 * CELL, chance.uniform(0, 6))
            if at_planes:
                tip = pyramid(4, chance.choice([50, 65]), 3 * CELL, 0.0)
            surface = Surface(tip, "tip.stl")
            more = {"shape": "surface", "file": surface, "axis": Vector(0, 0, -1)}
            self.files.append(surface)
            self.add_tool(top, at_planes, chance.uniform(0.3, 0.8), self.end, **more)
            return
        high = chance.uniform(2, 3.5)
        self.add_grid([-4, -4, 0], [5, 5, 8], ["free"] * 4 + ["fixed", "free"])
        self.add_material()
        shape = np.array(frustum(CELL * chance.uniform(1.5, 3), CELL * chance.uniform(1, 2), CELL * high))
        # off the lattice, which begins at the file's origin: on its diagonals two faces would be as near
        shape += CELL * np.array([chance.uniform(0.05, 0.2), chance.uniform(0.25, 0.45), 0.0])
        surface = Surface(shape, "body.stl")
        self.files.append(surface)
        origin = Vector(*(CELL * chance.choice([0.0, chance.random()]) for _ in range(2)), 0.0)
        body = {"material": "stuff", "shape": "surface", "file": surface, "origin": origin}
        self.bodies.append(self.add("body", **body, particles_per_cell=self.per_cell))
        self.add_tool([1.0, 1.0, high], False, chance.uniform(0.3, 0.8), self.end, shape="flat")

    # as it is seen

    def seen(self, m):
        other = copy.deepcopy(self)
        done = set()
        for _, values in other.groups:
            for name in values:
                if hasattr(values[name], "turn") and id(values[name]) not in done:
                    done.add(id(values[name]))
                    values[name].turn(m)
            if isinstance(values.get("lower"), Vector):
                low, high = values["lower"].values, values["upper"].values
                values["lower"].values, values["upper"].values = np.minimum(low, high), np.maximum(low, high)
        return other

    def mirrored(self):
        return self.seen(MIRROR)

    def turned(self):
        return self.seen(QUARTER_TURN)

    def write_files(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        for file in self.files:
            file.write(folder)

    def text(self, more=""):
        time = {"transfer": self.transfer, "domain": self.domain, "safety": 0.3}
        groups = [
            ("scene", {"title": f"seed {self.seed}: {self.family}", "end_time": self.end}),
            ("time", time),
        ]
        lines = []
        for kind, values in [*groups, *self.groups]:
            words = []
            for name, value in values.items():
                if hasattr(value, "text"):
                    value = value.text()
                elif isinstance(value, str):
                    value = f"'{value}'"
                elif isinstance(value, list):
                    value = point(value)
                else:
                    value = number(value)
                words.append(f"{name}={value}")
            lines.append(f"&{kind} {', '.join(words)} /")
        every = f"history_every={number(self.end / 50)}"
        lines.append(f"&output directory='OUT', formats='none', {every} /")
        return "\n".join([*lines, more]) + "\n"
