"""Small scenes made by chance that are given by a section: bodies of revolution and plane strain, with levels,
contact groups, tools, loads, damping, explicit and implicit steps. What is constant along y can be mirrored
along x and turned about y."""

import math
import random

import numpy as np
from mixtures import Axial, Mixture, Vector
from scenes import CELL, YOUNG

TURN_ABOUT_Y = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


class Section(Mixture):
    """A scene from a seed; the same everywhere. Lengths are drawn in cells and stand here in m."""

    quarter_turn = TURN_ABOUT_Y

    def __init__(self, seed):
        self.seed = seed
        self.chance = chance = random.Random(f"section {seed}")
        self.family = chance.choice(["free", "groups", "tool", "tool", "load", "implicit", "implicit"])
        self.round = chance.random() < 0.5
        self.per_cell = chance.choice([1, 8, 8, 8])
        self.domain = chance.choice(["fixed", "stretch", "corners", "corners"])
        self.transfer, self.flip, self.update = chance.choice(["affine", "affine", "plain"]), 1, "usl"
        self.groups, self.files, self.tools, self.bodies, self.levels = [], [], [], [], []
        self.law = chance.choice(["elastic", "neo_hookean", "j2", "j2"])
        self.poisson = chance.choice([0.0, 0.3, 0.3, 0.4])
        self.gravity, self.exact_end, self.strain, self.free = None, None, 0.0, False
        self.quarter = self.implicit = self.rubs = self.branches = False
        self.end = 200 * 0.3 * CELL / self.wave()
        getattr(self, f"make_{self.family}")()
        self.rubs = self.rubs or any("friction" in tool for tool in self.tools)

    def ways(self):
        """How else it can be looked at."""
        return ["2 ranks", "restarted"] + ([] if self.round else ["mirrored", "turned"])

    # what there is

    def add_section(self, left, right, low, high, foot, axis):
        """The grid from a left to a right side, and from a foot to the top."""
        self.add_grid([left, 0, low], [right, 1, high], [axis, "free", "symmetry", "symmetry", foot, "free"])
        self.add(
            "grid", geometry="axisymmetric" if self.round else "plane_strain", **self.groups.pop()[1]
        )  # of one group

    def add_ring(self, left, low, width, height, **more):
        """A box of the section: a ring, or a bar along y."""
        return self.add_box([left, 0, low], [width, 1, height], **more)

    def add_level(self, lower, upper):
        """A level between two places of the section, in whole cells."""
        lower, upper = (Vector(*(CELL * x for x in place)) for place in (lower, upper))
        self.levels.append(self.add("level", lower=lower, upper=upper))

    def add_effects(self):
        chance = self.chance
        if chance.random() < 0.5:
            g = 10 ** chance.uniform(-2, -0.5) * self.wave() / self.end
            self.gravity = [0.0 if self.round else g * chance.uniform(-1, 1), 0.0, g * chance.uniform(-1, 1)]
            self.add("gravity", acceleration=Vector(*self.gravity))
        if chance.random() < 0.3 and not self.free:
            rate = chance.choice([0.1, 1.0]) / self.end
            self.groups.append(("damping", {"kind": "viscous", "coefficient": rate}))

    def add_foot(self, low=3, high=5):
        """A block on a foot that holds it: its left side, its width and its height."""
        chance = self.chance
        width, height = self.pieces(low, high), self.pieces(low, high)
        on_axis = self.round and chance.random() < 0.7
        left = 0.0 if on_axis else 1.0 + chance.choice([0.0, 0.5, chance.random()])
        if not self.round and chance.random() < 0.3:
            left, on_axis = 0.0, True  # half of it
        axis = "symmetry" if on_axis else "free"
        start = 0 if on_axis else (0.5 if self.round else -3)
        # in quasi-static steps nothing else holds it along x
        loose = self.implicit and not (on_axis or self.round)
        foot = "fixed" if loose else chance.choice(["fixed", "roller"])
        self.add_section(start, start + math.ceil(left + width) + 4, 0, 10, foot, axis)
        self.add_material()
        self.add_ring(left, 0, width, height)
        return left, width, height, on_axis

    def upper_part(self, right, height, depth):
        """A box of whole cells around the upper part of a block: two places."""
        start = self.groups[0][1]["lower"].values[0] / CELL
        low = max(2, math.floor(height) - depth)
        end = start + math.ceil(right - start) + 2
        end = min(end, self.groups[0][1]["upper"].values[0] / CELL)
        return [start, 0, low], [end, 1, max(low + 4, math.ceil(height) + 2)]

    def add_load(self, left, width, height, largest=-1.5):
        """A pressure on the top, or on the right side, of at most a power of ten of Young's modulus."""
        share = 10 ** self.chance.uniform(-3, largest) * self.chance.choice([-1, 1])
        self.branches = self.law == "j2" and share > 0.02
        low, high = (left, 0.0, height), (left + width, 1.0, height)
        if self.chance.random() < 0.4:
            low, high = (left + width, 0.0, 0.0), (left + width, 1.0, height)
        lower, upper = (Vector(*(CELL * x for x in place)) for place in (low, high))
        times, values = [0, 0.5 * self.end], [0, share * YOUNG]
        self.add("pressure", lower=lower, upper=upper, times=times, values=values)

    def add_tip(self, left, width, height, on_axis):
        """A tool that goes in from above, and stands or comes back."""
        chance = self.chance
        at = 0.0 if on_axis else left + chance.uniform(0.3, 0.7) * width
        shapes = ["sphere", "cone", "flat"] if self.round else ["cylinder", "wedge"]
        more = {"shape": chance.choice(shapes)}
        if not self.round:
            more["edge"] = Vector(0, 1, 0)
        if more["shape"] == "cylinder":
            more["radius"] = chance.uniform(1.5, 4) * CELL
        self.add_tool([2 * at, 0, height], True, chance.uniform(0.3, 0.8), self.end, **more)
        tool = self.tools[-1]
        tool["tip"].values[0] = 0.0 if self.round else CELL * at
        for name in ("half_angle", "radius"):
            if name in tool:
                self.groups[-1][1][name] = tool[name]

    # families

    def make_free(self):
        """One or two boxes in flight through an edge of a level."""
        chance = self.chance
        self.free = True
        speed = 10 ** chance.uniform(-2.5, -1.3) * self.wave()
        left = 0.0 if self.round and chance.random() < 0.5 else chance.uniform(1, 2)
        start = 0 if self.round else -4
        self.add_section(start, start + 14, -4, 10, "free", "symmetry" if self.round else "free")
        self.add_material()
        more = {"velocity": Vector(0.0 if self.round else speed * chance.uniform(-1, 1), 0, speed)}
        if not self.round and chance.random() < 0.5:
            more["angular_velocity"] = Axial(0, 0.3 * speed / CELL * chance.uniform(-1, 1), 0)
        self.add_ring(left, chance.random(), self.pieces(2, 4), self.pieces(2, 4), **more)
        if chance.random() < 0.7:
            self.add_level([start if self.round else 0, 0, 0], [start + 8, 1, chance.choice([4, 5])])
        self.add_effects()

    def make_groups(self):
        """Two boxes that meet, free."""
        chance = self.chance
        self.free = True
        speed = 10 ** chance.uniform(-2.5, -1.3) * self.wave()
        left = 0.0 if self.round and chance.random() < 0.5 else 1.0 + 0.5 * chance.randint(0, 2)
        start = 0 if self.round else -4
        self.add_section(start, start + 14, -5, 12, "free", "symmetry" if self.round else "free")
        self.add_material()
        height, gap = self.pieces(2, 4), chance.choice([0.0, 0.05])
        side = 0.0 if self.round else 0.3 * speed * chance.uniform(-1, 1)
        first = {"velocity": Vector(side, 0, speed), "contact_group": "a", "name": "a"}
        second = {"velocity": Vector(0, 0, -speed), "contact_group": "b", "name": "b"}
        self.add_ring(left, 0, self.pieces(2, 4), height, **first)
        shift = 0.0 if left == 0 else 0.5 * chance.randint(0, 2)
        self.add_ring(left + shift, height + gap, self.pieces(2, 4), self.pieces(2, 4), **second)
        contact = {"friction": chance.choice([0, 0.3])}
        if chance.random() < 0.3:
            contact |= {"bond_strength": YOUNG * 10 ** chance.uniform(-3, -1.5)}
            contact |= {"adhesion": YOUNG * CELL * 1e-5}
        self.rubs = contact["friction"] > 0 or "adhesion" in contact
        self.add("body_contact", **contact)

    def make_tool(self):
        """A block under a tool, often on a level of its upper part."""
        left, width, height, on_axis = self.add_foot()
        if self.chance.random() < 0.6:
            self.add_level(*self.upper_part(left + width, height, self.chance.choice([2, 3])))
        self.add_tip(left, width, height, on_axis)
        self.add_effects()

    def make_load(self):
        """A block under a pressure, often across an edge of a level."""
        left, width, height, _ = self.add_foot()
        if self.chance.random() < 0.6:
            self.add_level(*self.upper_part(left + width, height, 2))
        self.add_load(left, width, height)
        self.add_effects()

    def make_implicit(self):
        """A block under a tool or a pressure, by quasi-static steps or implicit ones with inertia."""
        chance = self.chance
        self.implicit, self.end = True, 1.0
        if self.domain == "corners":
            self.per_cell = 8  # with one a cell modes that only the ghost penalty holds creep with each step
        left, width, height, on_axis = self.add_foot()
        mode = chance.choice(["static", "static", "newmark"])
        self.static = mode == "static"
        step = {"step": 0.05, "max_step": 0.05, "mode": mode, "tolerance": 1e-8}
        if mode == "newmark":
            step["theta"] = chance.choice([0.5, 1.0])
        if chance.random() < 0.6:
            self.add_tip(left, width, height, on_axis)
        else:
            self.add_load(left, width, height, largest=-2.0)
        self.add("quasi_static", **step)

    def turned(self):
        return self.seen(TURN_ABOUT_Y)
