#!/usr/bin/env python3
"""Valid quasi-static scenes made by chance: each must end with status 0 or a clean 3, as those of
random_scenes.py, which says what clean is.

usage: random_statics.py WORK PROGRAM COUNT [--first SEED] [--ranks 1 2 3 4]

Bodies are held or lie loose, tools press deep or with too much load: many scenes have no equilibrium, and
must say so. From seed 1000 on the body is cut in two, one on top of the other, of different contact groups."""

import random

from random_scenes import Scene, main, number, point

IN_TWO = 1000  # from this seed on
EXPLICIT = 30  # steps before, or after, the quasi-static ones where a run changes


class StaticScene(Scene):
    """One body on the lower side of the grid. Lengths are drawn in cells, times in shares of the run's."""

    def __init__(self, seed):
        self.chance = chance = random.Random(seed)
        self.cell = 10 ** chance.uniform(-8, 0)
        self.cells = [chance.randint(4, 7) for _ in range(3)]
        self.origin = [chance.choice([0.0, -4.0, 3.25]) for _ in range(3)]  # cells
        self.boundary = [chance.choice(["free", "free", "symmetry", "roller", "fixed"]) for _ in range(4)]
        self.boundary += [chance.choice(["fixed", "fixed", "roller", "symmetry"]), "free"]
        self.per_cell = chance.choice([1, 8, 8, 8, 27])
        self.levels = self.make_levels()[:1]
        self.time = 10 ** chance.uniform(-3, 5)
        self.materials = [self.make_material(n) for n in range(chance.randint(1, 2))]
        self.speed = max(one["wave"] for one in self.materials)
        self.tools_wanted = True
        self.bodies = self.make_bodies()
        self.tools = [self.make_tool(n) for n in range(chance.choice([0, 1, 1, 1, 2]))]
        self.friction = None
        if seed >= IN_TWO:
            self.cut_in_two()

    def cut_in_two(self):
        """The body as two in layers of its particles. Tools go by the first, which keeps its old bounds."""
        body, edge = self.bodies[0], {1: 1.0, 8: 0.5, 27: 1 / 3}[self.per_cell]
        layers = round((body["high"][2] - body["low"][2]) / edge)
        if layers < 2:
            return
        self.friction = self.chance.choice([0, 0, 0.2, 0.6])
        middle = body["low"][2] + edge * self.chance.randint(1, layers - 1)
        rest = body["text"][body["text"].index(", material") :]
        halves = [(body["low"], [*body["high"][:2], middle]), ([*body["low"][:2], middle], body["high"])]
        texts = [
            f"shape='box', lower={point(self.at(low))}, upper={point(self.at(high))}{rest}, "
            f"contact_group='{name}'"
            for name, (low, high) in zip(("below", "above"), halves)
        ]
        body["text"] = texts[0]
        self.bodies.append(dict(body, text=texts[1]))

    def make_material(self, n):
        chance = self.chance
        density, young = 10 ** chance.uniform(1, 4.5), 10 ** chance.uniform(3, 11.5)
        poisson = chance.choice([0.0, 0.3, 0.3, 0.45, -0.2])
        model = chance.choice(["elastic", "neo_hookean", "j2", "norton", "maxwell"])
        text = (
            f"name='m{n}', model='{model}', density={number(density)}, young={number(young)}, "
            f"poisson={poisson}"
        )
        yields = young * 10 ** chance.uniform(-3.5, -1.5)
        if model == "j2":
            hardening = chance.choice([0, 0.01, 0.1]) * young
            text += f", yield_stress={number(yields)}, hardening_modulus={number(hardening)}"
        elif model == "norton":
            rate = 10 ** chance.uniform(-2, 1) * yields / young / self.time  # ten relaxations or fewer
            text += (
                f", creep_stress={number(yields)}, creep_rate={number(rate)}, "
                f"creep_exponent={chance.choice([1, 3, 5, 8])}"
            )
            if chance.random() < 0.3:
                text += f", yield_stress={number(3 * yields)}"
        elif model == "maxwell":
            text += (
                f", relaxation_times={point([0.1 * self.time, self.time])}, "
                f"shear_ratios={point([chance.uniform(0, 0.5), chance.uniform(0, 0.4)])}"
            )
        wave = (young / density * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson)) ** 0.5
        return {"text": text, "wave": wave, "young": young, "density": density}

    def make_tool(self, n):
        """A tool that goes in and stands, goes on or comes back; or is pushed."""
        chance, body = self.chance, self.bodies[0]
        shape = chance.choice(["sphere", "sphere", "cone", "flat", "berkovich", "cylinder", "wedge"])
        tip = [
            chance.choice([body["low"][a], chance.uniform(body["low"][a], body["high"][a])]) for a in range(2)
        ]
        tip.append(body["high"][2] + chance.choice([0.0, 0.1]))
        text = f"name='t{n}', shape='{shape}', tip={point(self.at(tip))}, axis=0,0,-1"
        if shape in ("cone", "wedge"):
            text += f", half_angle={chance.choice([45, 70.3, 85])}"
        if shape in ("sphere", "flat", "cylinder"):
            text += f", radius={number(chance.uniform(1, 8) * self.cell)}"
        if chance.random() < 0.3:
            load = 10 ** chance.uniform(-4, -1.5) * self.materials[0]["young"] * self.cell**2
            mass = self.materials[0]["density"] * self.cell**3
            text += f", times={point([0, 0.5 * self.time])}, loads=0,{number(load)}, mass={number(mass)}"
        else:
            speed = 10 ** chance.uniform(-1.5, 0.3) * self.cell / self.time
            text += (
                f", times={point([0, 0.5 * self.time])}, "
                f"speeds={point([speed, chance.choice([0.0, speed, -speed])])}"
            )
        text += f", friction={chance.choice([0, 0, 0.2, 0.6])}"
        return {"text": text, "speed": 0.0}

    def effects(self):
        chance, lines = self.chance, []
        if chance.random() < 0.3:
            pull = 10 ** chance.uniform(-4, -1.5) * self.speed**2 / (10 * self.cell)
            lines.append(f"&gravity acceleration={point([0, 0.2 * pull, -pull])} /")
        body = self.bodies[0]
        if chance.random() < 0.3:
            low, high = list(body["low"]), list(body["high"])
            low[2] = high[2]
            value = 10 ** chance.uniform(-4, -1.5) * self.materials[0]["young"] * chance.choice([1, -1])
            lines.append(
                f"&pressure lower={point(self.at(low))}, upper={point(self.at(high))}, "
                f"times=0,{number(self.time)}, values=0,{number(value)} /"
            )
        lines.append(chance.choice(["", "", "&anti_locking /", "&anti_locking kind='none' /"]))
        return lines

    def text(self):
        chance = self.chance
        end, some = self.time, EXPLICIT * 0.3 * self.cell / self.speed
        step = chance.choice([0.05, 0.1, 0.3]) * self.time
        steps = f"step={number(step)}, stabilisation={chance.choice([0.0333] * 6 + [0.1, 0.01])}"
        if chance.random() < 0.5:
            steps += f", max_step={number(step)}"
        if chance.random() < 0.3:
            steps += f", ramp={number(0.5 * self.time)}"
        change = chance.random()
        if change < 0.15:
            steps += f", from={number(some)}"
        elif change < 0.3:
            steps += f", to={number(end)}"
            end += some
        lines = [
            f"&scene title='made by chance', end_time={number(end)} /",
            f"&grid lower={point(self.at([0] * 3))}, upper={point(self.at(self.cells))}, "
            f"cell_size={number(self.cell)},",
            "      boundary=" + ",".join(f"'{word}'" for word in self.boundary) + " /",
            f"&time domain='{chance.choice(['fixed', 'stretch', 'stretch', 'corners'])}' /",
        ]
        follow = ", follow='t0'" if self.tools and chance.random() < 0.3 else ""
        for low, high in self.levels:
            lines.append(f"&level lower={point(self.at(low))}, upper={point(self.at(high))}{follow} /")
        lines += [f"&material {one['text']} /" for one in self.materials]
        lines += [f"&body {one['text']} /" for one in self.bodies]
        if self.friction:
            lines.append(f"&body_contact friction={self.friction} /")
        lines += [f"&tool {one['text']} /" for one in self.tools] + self.effects()
        lines += [f"&quasi_static {steps} /", f"&output directory='OUT', every={number(end / 3)} /"]
        if chance.random() < 0.3:
            lines.append("&checkpoint every_steps=5 /")
        return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main(StaticScene, __doc__, limit=600)
