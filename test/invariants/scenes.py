"""Small scenes made by chance, as data that can be turned: mirrored along x, or made whole where they are a
quarter."""

import copy
import math
import random

CELL = 0.1  # m
YOUNG = 1e6  # Pa
DENSITY = 1000.0  # kg/m3
EDGE = {1: 1.0, 8: 0.5, 27: 1 / 3}  # of a particle, cells
SIDES = ("x-", "x+", "y-", "y+", "z-", "z+")


def number(x):
    return f"{x:.15g}"


def point(values):
    return ",".join(number(x) for x in values)


class Scene:
    """A scene from a seed; the same everywhere. Lengths are drawn in cells and stand here in m."""

    def __init__(self, seed):
        self.seed = seed
        self.chance = chance = random.Random(seed)
        self.family = chance.choice(["rod", "rod", "block", "block", "tool", "tool", "tool", "free"])
        self.per_cell = chance.choice([1, 8, 8, 27])
        self.domain = chance.choice(["fixed", "fixed", "stretch", "corners"])
        self.transfer = chance.choice(["affine", "affine", "affine", "plain"])
        self.flip = chance.choice([1, 1, 1, 0.99])
        self.update = chance.choice(["usl", "usl", "usl", "usf", "musl"])
        self.groups, self.bodies, self.tools, self.patches, self.levels = [], [], [], [], []
        self.gravity, self.damping, self.exact_end, self.strain = None, 0.0, None, 0.0
        self.quarter = False  # two sides are planes of symmetry of everything
        self.steps = 300
        self.make_material()
        getattr(self, f"make_{self.family}")()
        if chance.random() < 0.2:
            self.groups.append("&anti_locking /")
        if chance.random() < 0.1:
            self.groups.append("&bulk_viscosity /")
        if self.levels:
            self.update = "usl"

    # what there is

    def make_material(self):
        chance = self.chance
        self.law = chance.choice(["elastic", "neo_hookean", "neo_hookean", "j2", "johnson_cook"])
        self.poisson = chance.choice([0.0, 0.3, 0.3, 0.45])
        self.yields = YOUNG * 10 ** chance.uniform(-2.5, -1)

    def material(self):
        text = (
            f"&material name='stuff', model='{self.law}', density={number(DENSITY)}, "
            f"young={number(YOUNG)}, poisson={self.poisson}"
        )
        if self.law == "j2":
            text += f", yield_stress={number(self.yields)}, hardening_modulus={number(0.02 * YOUNG)}"
        elif self.law == "johnson_cook":
            text += (
                f", yield_stress={number(self.yields)}, hardening_modulus={number(self.yields)}, "
                "hardening_exponent=0.3, "
                "rate_coefficient=0.02, thermal_exponent=1, melting_temperature=1300, specific_heat=400"
            )
        return text + " /"

    def wave(self):
        nu = self.poisson
        return math.sqrt(YOUNG / DENSITY * (1 - nu) / (1 + nu) / (1 - 2 * nu))

    def duration(self):
        return self.steps * 0.3 * CELL / self.wave()

    def pieces(self, low, high):
        """A length between two numbers of cells, of whole particles."""
        edge = EDGE[self.per_cell]
        return self.chance.randint(math.ceil(low / edge), math.floor(high / edge)) * edge

    def box(self, lower, size, **more):
        """Lengths in cells."""
        self.bodies.append(
            {
                "lower": [x * CELL for x in lower],
                "upper": [(x + s) * CELL for x, s in zip(lower, size)],
                **more,
            }
        )

    def grid(self, lower, upper, boundary):
        self.lower, self.upper, self.boundary = [x * CELL for x in lower], [x * CELL for x in upper], boundary

    def patch(self, axis, side, low, high, value):
        """A pressure on part of a face of the first body: shares of the face along the other two axes."""
        body = self.bodies[0]
        lower, upper = list(body["lower"]), list(body["upper"])
        lower[axis] = upper[axis] = body["upper" if side else "lower"][axis]
        others = [a for a in range(3) if a != axis]
        for a, l, h in zip(others, low, high):
            lower[a], upper[a] = (
                body["lower"][a] + s * (body["upper"][a] - body["lower"][a]) for s in (l, h)
            )
        rise = self.duration() * self.chance.choice([0.3, 0.3, 1.0])
        self.patches.append({"lower": lower, "upper": upper, "times": [0, rise], "values": [0, value]})

    def level(self, lower, upper):
        self.levels.append(([x * CELL for x in lower], [x * CELL for x in upper]))

    # families

    def make_rod(self):
        """Pulled or pushed along z between planes of symmetry, without cross contraction: every place has the
        stress -p, and with the rate form the end goes to L exp(-p/E). Damped so that it rests."""
        chance = self.chance
        self.law, self.poisson, self.flip = "elastic", 0.0, 1
        self.strain = chance.choice([-1, -1, 1]) * chance.uniform(0.02, 0.35)
        wide = 2 if chance.random() < 0.8 else 4
        length = self.pieces(5, 10)
        self.grid(
            [0, 0, 0],
            [wide, wide, math.ceil(length * math.exp(max(0.0, -self.strain))) + 4],
            ["symmetry"] * 5 + ["free"],
        )
        self.box([0, 0, 0], [wide, wide, length])
        self.steps = 600
        self.patch(2, 1, (0, 0), (1, 1), self.strain * YOUNG)
        self.patches[0]["times"][1] = 0.4 * self.duration()
        self.damping = 2 * math.pi * self.wave() / (4 * length * CELL) * 1.2
        self.exact_end = length * CELL * (math.exp(-self.strain) - 1)
        if wide == 4 and chance.random() < 0.7:
            middle = 2 * round(length / 4)
            self.level([0, 0, middle - 2], [4, 4, self.upper[2] / CELL])
        self.quarter = not self.levels

    def base(self):
        """A block on something, of a quarter or not: its size, and how high there is room."""
        chance = self.chance
        self.quarter = chance.random() < 0.5
        size = [self.pieces(3, 5) for _ in range(3)]
        wide = [math.ceil(s) + 3 for s in size]
        high = math.ceil(size[2]) + 4
        foot = chance.choice(["symmetry", "fixed", "roller"])
        if self.quarter:
            self.grid([0, 0, 0], wide[:2] + [high], ["symmetry", "free", "symmetry", "free", foot, "free"])
            self.box([0, 0, 0], size)
        else:
            shift = [chance.random(), chance.random()]
            self.grid([-3, -3, 0], [wide[0] + 1, wide[1] + 1, high], ["free"] * 4 + [foot, "free"])
            self.box([*shift, 0], size)
        return size, high

    def maybe_level(self, size, high):
        """A finer level that holds the upper part: all of it under a tool, else some."""
        if self.chance.random() < 0.25:
            first = 2 * max(1, int(size[2] / 4))
            top = high if self.chance.random() < 0.5 else high - 2
            if top - first < 4:
                return
            low = [0, 0] if self.quarter else [-1, -1]
            wide = [4, 4]
            if self.tools:
                wide = [round(self.upper[a] / CELL) - 2 - low[a] for a in (0, 1)]
            self.level([*low, first], [low[0] + wide[0], low[1] + wide[1], top])

    def make_block(self):
        """Pressures of either sign on faces, gravity, damping."""
        chance = self.chance
        size, high = self.base()
        for _ in range(chance.choice([1, 1, 2])):
            value = chance.choice([-1, 1]) * YOUNG * 10 ** chance.uniform(-3, -0.9)
            if self.law in ("j2", "johnson_cook"):
                value = math.copysign(min(abs(value), 1.2 * self.yields), value)
            if self.quarter or chance.random() < 0.6:
                low = (0, 0) if self.quarter else (chance.choice([0, 0.2]), chance.choice([0, 0.3]))
                self.patch(2, 1, low, (chance.choice([1, 0.7]), chance.choice([1, 0.55])), value)
            else:
                self.patch(0, chance.randint(0, 1), (0.25, 0.4), (1, 1), value)
            if len(self.patches) == 1 and value < 0:
                self.strain = value / YOUNG
        if chance.random() < 0.4:
            slope = 0.0 if self.quarter else chance.uniform(-0.3, 0.3)
            pull = 10 ** chance.uniform(-2.5, -1.2) * YOUNG / DENSITY / (size[2] * CELL)
            self.gravity = [slope * pull, -slope * pull, chance.choice([-1, -1, 1]) * pull]
        if chance.random() < 0.6:
            self.damping = chance.uniform(0.3, 2) * self.wave() / (size[2] * CELL)
        self.maybe_level(size, high)

    def make_tool(self):
        """One or two tools into a block, by speed or load, with and without friction."""
        chance = self.chance
        size, high = self.base()
        body = self.bodies[0]
        for n in range(1 if self.quarter or chance.random() < 0.7 else 2):
            shape = chance.choice(["sphere", "sphere", "flat", "cone", "cylinder", "wedge", "berkovich"])
            if self.quarter and shape == "berkovich":
                shape = "cone"
            if self.quarter:
                tip = [0.0, 0.0]
            else:
                tip = [body["lower"][a] + chance.uniform(0.2, 0.8) * size[a] * CELL for a in range(2)]
            tip.append(body["upper"][2] + chance.choice([1e-3, 0.1]) * CELL)
            tool = {"name": f"t{n}", "shape": shape, "tip": tip, "friction": chance.choice([0, 0, 0.3])}
            if shape == "berkovich":
                tool["edge"] = [1.0, 0.0, 0.0]
            if shape in ("cone", "wedge"):
                tool["half_angle"] = chance.choice([45, 60, 70.3])
            if shape in ("sphere", "flat", "cylinder"):
                tool["radius"] = chance.uniform(1.5, 5) * CELL
            tilt = 0.0
            # its tip is not its lowest point then
            if shape == "sphere" and not self.quarter and chance.random() < 0.5:
                tilt = chance.uniform(-0.5, 0.5)
                tip[2] += tool["radius"] * (1 - math.cos(tilt))
            tool["axis"] = [math.sin(tilt), 0.0, -math.cos(tilt)]
            depth = chance.uniform(0.3, 1.2) * CELL
            time = self.duration()
            speed = depth / (0.7 * time)
            if chance.random() < 0.25:
                load = YOUNG * CELL**2 * 10 ** chance.uniform(-2, -0.7)
                tool |= {
                    "times": [0, 0.3 * time],
                    "loads": [0, load],
                    "mass": DENSITY * CELL**3 * chance.uniform(5, 100),
                }
            else:
                back = chance.choice([0.0, 0.0, -speed])
                tool |= {"times": [0, 0.1 * time, 0.7 * time, 0.8 * time], "speeds": [0, speed, speed, back]}
            self.tools.append(tool)
        if chance.random() < 0.3:
            self.damping = chance.uniform(0.3, 2) * self.wave() / (size[2] * CELL)
        self.maybe_level(size, high)

    def make_free(self):
        """Bodies that fly, turn and ring, with nothing that holds them; gravity sometimes."""
        chance = self.chance
        self.grid([-8, -8, -8], [8, 8, 8], ["free"] * 6)
        for n in range(chance.choice([1, 1, 2])):
            size = [self.pieces(2, 4) for _ in range(3)]
            lower = [
                chance.uniform(-5.5, -4.5)
                if a == 0 and n == 0
                else chance.uniform(1, 2)
                if a == 0
                else chance.uniform(-3, -1)
                for a in range(3)
            ]
            velocity = [chance.uniform(-1, 1) * 0.02 * self.wave() for _ in range(3)]
            self.box(
                lower,
                size,
                velocity=velocity,
                angular_velocity=[chance.uniform(-1, 1) * 0.02 * self.wave() / CELL for _ in range(3)],
            )
        if chance.random() < 0.4:
            self.gravity = [chance.uniform(-1, 1) * 0.02 * self.wave() / self.duration() for _ in range(3)]
        if chance.random() < 0.3:
            low = [2 * chance.randint(-3, -1) for _ in range(3)]
            self.level(low, [l + 2 * chance.randint(2, 3) for l in low])

    # as it is turned

    def mirrored(self):
        """The mirror image along x."""
        other = copy.deepcopy(self)
        other.lower[0], other.upper[0] = -self.upper[0], -self.lower[0]
        other.boundary = [self.boundary[1], self.boundary[0], *self.boundary[2:]]
        for one in other.bodies + other.patches:
            one["lower"][0], one["upper"][0] = -one["upper"][0], -one["lower"][0]
        for one in other.bodies:
            if "velocity" in one:
                one["velocity"][0] *= -1
                one["angular_velocity"][1] *= -1
                one["angular_velocity"][2] *= -1
        for low, high in other.levels:
            low[0], high[0] = -high[0], -low[0]
        for tool in other.tools:
            tool["tip"][0] *= -1
            tool["axis"][0] *= -1
            if "edge" in tool:
                tool["edge"][0] *= -1
        if other.gravity:
            other.gravity[0] *= -1
        return other

    def whole(self):
        """All four quarters of a quarter."""
        other = copy.deepcopy(self)
        for a in (0, 1):
            other.lower[a] = -self.upper[a]
            other.boundary[2 * a] = self.boundary[2 * a + 1]
            for one in other.bodies + other.patches:
                one["lower"][a] = -one["upper"][a]
            for low, high in other.levels:
                low[a] = -high[a]
        for tool in other.tools:
            for value in ("loads", "mass"):
                if value in tool:
                    tool[value] = [4 * x for x in tool[value]] if value == "loads" else 4 * tool[value]
        return other

    def text(self):
        lines = [
            f"&scene title='seed {self.seed}: {self.family}', end_time={number(self.duration())} /",
            f"&grid lower={point(self.lower)}, upper={point(self.upper)}, cell_size={number(CELL)},",
            "      boundary=" + ",".join(f"'{word}'" for word in self.boundary) + " /",
            f"&time safety=0.3, stress_update='{self.update}', transfer='{self.transfer}', "
            f"domain='{self.domain}', flip_fraction={self.flip} /",
            self.material(),
        ]
        lines += [f"&level lower={point(low)}, upper={point(high)} /" for low, high in self.levels]
        for body in self.bodies:
            extra = "".join(
                f", {name}={point(body[name])}" for name in ("velocity", "angular_velocity") if name in body
            )
            lines.append(
                f"&body material='stuff', shape='box', lower={point(body['lower'])}, "
                f"upper={point(body['upper'])}, particles_per_cell={self.per_cell}{extra} /"
            )
        for tool in self.tools:
            words = [f"{name}='{tool[name]}'" for name in ("name", "shape")]
            words += [
                f"{name}={number(tool[name])}"
                for name in ("friction", "half_angle", "radius", "mass")
                if name in tool
            ]
            words += [
                f"{name}={point(tool[name])}"
                for name in ("tip", "axis", "edge", "times", "speeds", "loads")
                if name in tool
            ]
            lines.append("&tool " + ", ".join(words) + " /")
        for patch in self.patches:
            lines.append(
                "&pressure " + ", ".join(f"{name}={point(values)}" for name, values in patch.items()) + " /"
            )
        if self.gravity:
            lines.append(f"&gravity acceleration={point(self.gravity)} /")
        if self.damping:
            lines.append(f"&damping kind='viscous', coefficient={number(self.damping)} /")
        if self.exact_end is not None:
            half = 0.5 * EDGE[self.per_cell] * CELL
            place = [
                self.bodies[0]["lower"][0] + half,
                self.bodies[0]["lower"][1] + half,
                self.bodies[0]["upper"][2] - half,
            ]
            if self.levels:  # where a particle is split, one of its parts is followed
                place = [p - 0.2 * half for p in place]
            lines.append(f"&probe name='end', position={point(place)} /")
        lines += self.groups
        lines.append(
            f"&output directory='OUT', formats='none', history_every={number(self.duration() / 100)} /"
        )
        return "\n".join(lines) + "\n"
