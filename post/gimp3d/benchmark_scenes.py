"""Scenes of the book of benchmarks (doc/user/benchmarks.md), made of numbers.

All have one form of body: a block that is bonded to a rigid base, on nested levels whose finest cells lie
under the tool. The exact solution of the layer (layered.py) is that of such a block, so what the base
adds to stiffness is known. Lengths in the text are whole numbers of the finest cell."""

import math
from dataclasses import dataclass

finest = 100e-9  # m, cells under the tool; no law here knows a length, so it only sets the scale
density, young, poisson = 2710.0, 70e9, 0.3
plane_modulus = young / (1 - poisson**2)


def wave_speed(modulus=young):
    """Of pressure waves, m/s."""
    return math.sqrt(modulus * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson)) / density)


def words(values):
    return ",".join(f"{value:.10g}" for value in values)


@dataclass(frozen=True)
class Grid:
    """Nested levels. `height` and `width` of the block are in cells of the coarsest grid; `boxes` has for
    each level how far it reaches from the axis and down from the surface, in cells of the grid that it
    refines."""

    name: str
    height: int
    width: int
    boxes: tuple
    contact: float = 0.0  # finest cells to the radius of the contact at the end, about
    cell: float = finest
    half: bool = False  # half model, for tools of one mirror plane; else a quarter
    closed: bool = False  # the block's sides are held by symmetry, so that it may be under stress; else free
    section: bool = False  # given by its section: a disk and what a tool of revolution does to it

    @property
    def coarsest(self):
        return self.cell * 2 ** len(self.boxes)

    @property
    def thickness(self):
        """Of the block, m."""
        return self.height * self.coarsest

    def groups(self):
        big, top = self.coarsest, self.thickness
        if self.section:
            return self.flat_groups()
        far, side = (self.width, "symmetry") if self.closed else (self.width + 1, "free")
        left, near = (-far * big, side) if self.half else (0.0, "symmetry")
        lines = [
            f"&grid     lower={words((left, 0, 0))}, "
            f"upper={words((far * big, far * big, top + 2 * big))}, "
            f"cell_size={big:.10g},\n"
            f"          boundary='{near}','{side}','symmetry','{side}','fixed','free' /"
        ]
        for number, (width, depth) in enumerate(self.boxes):
            cell = big / 2**number
            left = -width * cell if self.half else 0.0
            lines.append(
                f"&level    lower={words((left, 0, top - depth * cell))}, "
                f"upper={words((width * cell, width * cell, top + 2 * cell))} /"
            )
        return lines

    def flat_groups(self):
        big, top = self.coarsest, self.thickness
        lines = [
            "&grid     geometry='axisymmetric', lower=0,0,0, "
            f"upper={words(((self.width + 1) * big, big, top + 2 * big))}, cell_size={big:.10g},\n"
            "          boundary='symmetry','free','symmetry','symmetry','fixed','free' /"
        ]
        for number, (width, depth) in enumerate(self.boxes):
            cell = big / 2**number
            lines.append(
                f"&level    lower={words((0, 0, top - depth * cell))}, "
                f"upper={words((width * cell, big, top + 2 * cell))} /"
            )
        return lines

    def box(self, material, lower=0.0, upper=None, stress=0.0):
        """A block from side to side, under an equal stress (Pa) along both."""
        wide = self.width * self.coarsest
        stressed = f"stress={stress:.10g},{stress:.10g},4*0, " if stress else ""
        return (
            f"&body     material='{material}', shape='box', "
            f"lower={words((-wide if self.half else 0.0, 0, lower))}, "
            f"upper={words((wide, wide, self.thickness if upper is None else upper))}, "
            f"{stressed}particles_per_cell=8 /"
        )


def elastic(name="elastic", modulus=young):
    law = f"name='{name}', model='elastic', density={density:g}, young={modulus:.10g}, poisson={poisson:g}"
    return f"&material {law} /"


table_points = 60


def power_law(yield_stress, exponent, name="metal"):
    """J2 with sigma = Y (1 + E e/Y)^n: a table whose strains rise from a tenth of the yield strain to 10, in
    a fixed ratio."""
    text = (
        f"&material name='{name}', model='j2', density={density:g}, young={young:.10g}, poisson={poisson:g}, "
    )
    if exponent == 0:
        return text + f"yield_stress={yield_stress:.10g} /"
    first = 0.1 * yield_stress / young
    strains = [0.0] + [first * (10 / first) ** (i / (table_points - 2)) for i in range(table_points - 1)]
    stresses = [yield_stress * (1 + young * e / yield_stress) ** exponent for e in strains]

    def listed(values):
        rows = [", ".join(f"{v:.8g}" for v in values[i : i + 8]) for i in range(0, len(values), 8)]
        return ",\n          ".join(rows)

    first = float(f"{stresses[0]:.8g}")  # as the table has it
    return (
        text + f"yield_stress={first:.10g},\n          hardening_strain={listed(strains)},\n"
        f"          hardening_stress={listed(stresses)} /"
    )


@dataclass
class Motion:
    """Speeds of a tool. It speeds up, goes on, slows down and stands if it comes back; its depth is exact by
    construction."""

    depth: float
    time: float  # s, until the largest depth
    back: float = 0.0  # m, 0: it does not come back
    hold: float = 0.1  # share of the time
    return_time: float = 0.5  # share of the time

    def values(self):
        """Times, speeds, end."""
        if not self.back:  # half of the time speeding up, then at one speed
            speed = self.depth / (0.75 * self.time)
            return (0, 0.5 * self.time), (0, speed), self.time
        ramp = 0.05 * self.time
        slow = 0.25 * self.time
        speed = self.depth / (self.time - 0.5 * ramp - 0.5 * slow)
        stand = (1 + self.hold) * self.time
        turn = 0.1 * self.time
        back = self.back / (self.return_time * self.time - 0.5 * turn)
        return (
            (0, ramp, self.time - slow, self.time, stand, stand + turn),
            (0, speed, speed, 0, 0, -back),
            stand + self.return_time * self.time,
        )

    def every(self):
        """Between snapshots: one stands at the largest depth, one at the end."""
        _, _, end = self.values()
        if not self.back:
            return end
        return (1 + self.hold) * self.time / 2


@dataclass
class Held:
    """Speeds of a tool that goes in at one speed and is held there."""

    depth: float
    time: float  # s, until the depth
    end: float  # s

    def values(self):
        """Times, speeds, end. It stops within a thousandth of its way."""
        stop = 1e-3 * self.time
        speed = self.depth / (self.time + 0.5 * stop)
        return (0, self.time, self.time + stop), (speed, speed, 0), self.end

    def every(self):
        return self.end


@dataclass
class Steps:
    """Speeds of a tool that goes in by `count` quasi-static steps of equal length in one second, stops in a
    tenth of that, turns, and comes back in 20 steps: the fit of the unloading wants ten rows. Domains follow
    their corners, as explicit steps choose for such a law."""

    depth: float
    count: int
    back: float

    def values(self):
        """Times, speeds, end."""
        way_back = 20 / self.count  # s
        speed, back = self.depth / 1.05, self.back / (way_back + 0.05)
        return (0, 1, 1.1, 1.2), (speed, speed, 0, -back), 1.2 + way_back

    def every(self):
        return 1.1

    def group(self):
        step = f"{1 / self.count:.10g}"
        return f"&time domain='corners' /\n&quasi_static step={step}, max_step={step} /"


def scene(
    title, comment, grid, materials, bodies, tool, motion, directory, effects=(), formats=None, pushed=None
):
    """The text of a scene. `tool` is its shape and numbers; `pushed` has, in place of the motion, mass (kg,
    of the whole tool), speed (m/s) and end (s)."""
    lines = [f"! {line}" for line in comment]
    share = 1.0 if grid.section else 0.5 if grid.half else 0.25
    if pushed:
        mass, speed, end = pushed
        moved, every = f"times=0, loads=0, mass={share * mass:.10g}, initial_speed={speed:.10g}", end
    else:
        times, speeds, end = motion.values()
        moved, every = f"times={words(times)}, speeds={words(speeds)}", motion.every()
    lines.append(f"&scene    title='{title}', end_time={end:.10g} /")
    lines += grid.groups() + list(materials) + list(bodies)
    lines.append(f"&tool     name='tool', {tool}, tip=0,0,{grid.thickness:.10g},\n          {moved} /")
    lines += list(effects)
    lines.append(
        f"&output   directory='{directory}', every={every:.10g}{f', formats={formats!r}' if formats else ''} "
        "/"
    )
    return "\n".join(lines) + "\n"


def flow_stress(yield_stress, exponent):
    """Stress (Pa) at a plastic strain of 0.033, by which Dao et al. (2001) order loads of sharp tools."""
    return yield_stress * (1 + 0.033 * young / yield_stress) ** exponent


def slow_time(depth, stress):
    """The time (s) in which a `Motion` goes to its depth (m) at half of stress/(rho c) at most. Metal that
    flows at `stress` carries no wave faster than that, so the load of a faster tool holds inertia."""
    return depth / 0.85 / (0.5 * stress / (density * wave_speed()))


def transits(grid, count, modulus=young):
    """The time that pressure waves take `count` times through the block."""
    return count * grid.thickness / wave_speed(modulus)
