"""The cases of the book of benchmarks: what each runs, what it is compared with, and what is to be said of
it.

A row is one problem on several grids. `Row.scene(grid)` is the text of its scene (None where nothing is run),
`Row.measure(runs)` gives {name of a quantity: number}, and `Row.references` say what these should be."""

import math
import tomllib
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from . import anisotropic
from . import benchmark_measures as measures
from .benchmark_scenes import (
    Grid,
    Held,
    Motion,
    Steps,
    density,
    elastic,
    finest,
    flow_stress,
    plane_modulus,
    poisson,
    power_law,
    scene,
    slow_time,
    transits,
    young,
)
from .indentation import rounded_cone, rounded_cone_depth
from .layered import Layers, stiffening

root = Path(__file__).resolve().parents[2]
references = tomllib.loads((root / "test/references/indentation.toml").read_text())
out = "out/benchmarks"


@dataclass
class Reference:
    """What a quantity should be. `absolute`: the tolerance is a difference, else a share. `source` is short,
    for the table."""

    name: str
    value: float
    tolerance: float | None = None
    absolute: bool = False
    source: str = ""


@dataclass
class Row:
    case: str
    name: str
    what: str  # in the table
    grids: dict = field(default_factory=dict)  # name: Grid
    make: object = None  # Grid -> text without its directory
    measure: object = None  # (directory, Grid) -> {quantity: number}
    references: list = field(default_factory=list)
    of: tuple = ()  # rows whose runs are used, in place of an own one

    def key(self, grid):
        return f"{self.name}_{grid}"

    def directory(self, grid):
        return f"{out}/{self.key(grid)}"

    def scene(self, grid):
        return self.make(self.grids[grid], self.directory(grid)) if self.make else None


@dataclass
class Case:
    name: str
    title: str
    source: str
    scene: str
    why: str  # what the error is, and why
    rows: list


@lru_cache(maxsize=None)
def layers_of(ratio=0.0, depth=math.inf):
    """Film and base of one Poisson's ratio; `ratio` of their moduli, `depth` of the base in films."""
    return Layers(poisson, ratio, poisson, depth)


# ---- grids ----


def nests(name, contact, levels, box, height=14, width=28, **more):
    """A block under nested levels of `box` cells of the grid around them, each way."""
    return Grid(name, height, width, ((box, box),) * levels, contact, **more)


sharp_grids = {"coarse": nests("coarse", 6, 4, 6, 10, 20), "fine": nests("fine", 9, 4, 9, 12, 24)}
section_grids = {
    "coarse": nests("coarse", 6, 4, 6, 10, 20, section=True),
    "fine": nests("fine", 9, 4, 9, 12, 24, section=True),
    "finer": nests("finer", 14, 4, 14, 18, 36, section=True),
}
half_grids = {
    "coarse": nests("coarse", 6, 4, 6, 10, 20, half=True),
    "fine": nests("fine", 8, 4, 8, 12, 24, half=True),
}
sphere_grids = {"coarse": nests("coarse", 6, 3, 6), "fine": nests("fine", 10, 3, 10, 16, 30)}
pyramid_grids = {
    "coarse": nests("coarse", 6, 3, 6, 12, 20, half=True),
    "fine": nests("fine", 10, 3, 10, 14, 24, half=True),
}
layer_grids = {
    "coarse": Grid("coarse", 10, 30, ((8, 8),), 8),
    "fine": Grid("fine", 8, 24, ((7, 8), (10, 10)), 12.8),
}
punch_grids = {
    "coarse": Grid("coarse", 15, 45, ((10, 10),), 12),
    "fine": Grid("fine", 12, 36, ((11, 12), (15, 15)), 19.2),
}
film_grids = {"coarse": nests("coarse", 8, 3, 8, 20, 40), "fine": nests("fine", 12, 3, 10, 30, 60)}
small_grids = {"coarse": nests("coarse", 5, 3, 5, 8, 16)}
tenfold_grids = {"coarse": nests("coarse", 5, 3, 5, 8, 16, cell=10 * finest)}


flat_sphere_grids = {
    name: replace(grid, section=True)
    for name, grid in (sphere_grids | {"finer": nests("finer", 15, 3, 15, 22, 42)}).items()
}
flat_layer_grids = {
    name: replace(grid, section=True)
    for name, grid in (layer_grids | {"finer": Grid("finer", 12, 36, ((11, 12), (15, 15)), 19.2)}).items()
}
flat_punch_grids = {
    name: replace(grid, section=True)
    for name, grid in (punch_grids | {"finer": Grid("finer", 15, 45, ((13, 15), (18, 18)), 24)}).items()
}
flat_film_grids = {
    name: replace(grid, section=True)
    for name, grid in (film_grids | {"finer": nests("finer", 16, 3, 14, 40, 80)}).items()
}


def by_section(rows, grids):
    """Rows of bodies of revolution, and beside each the same by its section."""
    found = []
    for row in rows:
        flat = replace(row, name=f"{row.name}_section", what=f"{row.what}, by its section", grids=grids(row))
        found += [row, flat]
    return found


def one_per_cell(text, grid):
    """The edge of a punch stands nearest to where it should with one particle a cell
    (doc/user/accuracy.md); in a section all of them have the compliance below a cell, which wants more."""
    return text if grid.section else text.replace("particles_per_cell=8", "particles_per_cell=1")


# ---- B1, B2, B12: elastic-plastic ----


def plastic(title, tool, ratio, exponent, radius_over_depth, way_back, share=0.0, step=None):
    """A scene of a pointed tool that goes in until its contact has the grid's radius, and comes back by
    `way_back` of its depth. `share`: of the yield stress, that the block is under along both its sides;
    `step`: way of the tool in a quasi-static step, cells (else steps are explicit)."""

    def make(grid, directory):
        depth = grid.contact * grid.cell / radius_over_depth
        time = max(transits(grid, 5.5), slow_time(depth, flow_stress(young / ratio, exponent)))
        if step:
            motion = Steps(depth, math.ceil(depth / (step * grid.cell)), way_back * depth)
        else:
            motion = Motion(depth, time, way_back * depth)
        return scene(
            title,
            [f"{title}. E/Y = {ratio:g}, n = {exponent:g}."],
            grid,
            [power_law(young / ratio, exponent)],
            [grid.box("metal", stress=share * young / ratio)],
            tool,
            motion,
            directory,
            effects=["&anti_locking /"] + ([motion.group()] if step else []),
        )

    return make


def sharp_numbers(shape, ratio, curvature, stiffness, work):
    """References of a pointed tool: C/Y, S/(E'h), work ratio, and what follows for the area and hardness."""
    area = (stiffness / references["area_of_stiffness"][shape]) ** 2
    return [
        Reference("C/Y", curvature, 0.02),
        Reference("S/(E'h)", stiffness, 0.04),
        Reference("Wp/Wt", work, 0.01, True),
        Reference("H/Y, true area", curvature / area, 0.04),
        Reference("H/Y, area of the profile", curvature / area, 0.04),
    ]


def sharp_row(case, name, what, shape, tool, grids, ratio, exponent, curvature, stiffness, work, **more):
    radius = stiffness / references["area_of_stiffness"][shape] / math.sqrt(math.pi)
    # P / (S h): how far back the load would go if the stiffness stayed
    way = curvature / ratio * (1 - poisson**2) / stiffness
    return Row(
        case,
        name,
        what,
        grids,
        plastic(
            f"{shape}, E/Y = {ratio:g}, n = {exponent:g}",
            tool,
            ratio,
            exponent,
            radius,
            min(1.4 * way, 0.8),
            **more,
        ),
        lambda directory, grid: measures.sharp(directory, grid, young / ratio),
        sharp_numbers(shape, ratio, curvature, stiffness, work),
    )


def cone_rows(case="B1", start="cone", grids=sharp_grids):
    """Ten rows over E/Y and n."""
    wanted = [(100, 0.0), (100, 0.3), (700, 0.0), (100, 0.5), (25, 0.0)]
    wanted += [(33.3333, 0.1), (50, 0.3), (180, 0.1), (333.333, 0.3), (700, 0.5)]
    rows = []
    for ratio, exponent in wanted:
        line = next(
            r for r in references["cone"]["rows"] if abs(r[0] / ratio - 1) < 1e-3 and r[1] == exponent
        )
        name = f"{start}_{round(ratio)}_{round(10 * exponent)}"
        what = f"E/Y = {line[0]:.4g}, n = {exponent:g}"
        rows.append(
            sharp_row(
                case, name, what, "cone", "shape='cone', half_angle=70.3", grids, line[0], exponent, *line[2:]
            )
        )
    return rows


def static_rows():
    """Three rows of B1 by quasi-static steps of a sixteenth of a cell."""
    rows = []
    for ratio, exponent in ((100.0, 0.0), (100.0, 0.5), (25.0, 0.0)):
        line = next(r for r in references["cone"]["rows"] if r[0] == ratio and r[1] == exponent)
        name = f"static_{round(ratio)}_{round(10 * exponent)}"
        what = f"E/Y = {ratio:g}, n = {exponent:g}"
        tool = "shape='cone', half_angle=70.3"
        rows.append(
            sharp_row("B1s", name, what, "cone", tool, sharp_grids, ratio, exponent, *line[2:], step=1 / 16)
        )
    return rows


def berkovich_rows():
    rows = []
    table = references["berkovich"]
    for modulus, stress, exponent, curvature, stiffness, work in table["rows"]:
        ratio = modulus / stress
        plane = modulus / (1 - table["poisson"] ** 2)
        rows.append(
            sharp_row(
                "B2",
                f"berkovich_{round(ratio)}_{round(10 * exponent)}",
                f"E/Y = {ratio:.4g}, n = {exponent:g}",
                "berkovich",
                f"shape='berkovich', half_angle={table['half_angle']}",
                half_grids,
                ratio,
                exponent,
                curvature / stress,
                stiffness / (plane * table["depth"]),
                work,
            )
        )
        for reference in rows[-1].references[:2]:
            reference.tolerance = 0.04
    return rows


def equal_cone_rows(disks):
    """The cone of equal area in the metals of B2, by its section; where B1a has run it, that."""
    rows = []
    for modulus, stress, exponent, *_ in references["berkovich"]["rows"]:
        ratio = modulus / stress
        line = next(
            r for r in references["cone"]["rows"] if abs(r[0] / ratio - 1) < 1e-3 and r[1] == exponent
        )
        name = f"{round(ratio)}_{round(10 * exponent)}"
        row = sharp_row(
            "B2c",
            f"equal_cone_{name}",
            f"E/Y = {ratio:.4g}, n = {exponent:g}",
            "cone",
            "shape='cone', half_angle=70.3",
            section_grids,
            line[0],
            exponent,
            *line[2:],
        )
        same = [disk for disk in disks if disk.name == f"disk_{name}"]
        rows.append(replace(row, make=None, of=tuple(same)) if same else row)
    return rows


def sphere_plastic_row():
    """A sphere in perfectly plastic metal, E*/Y = 100."""
    table, ratio = references["elastic_plastic_sphere"], 100.0 * (1 - poisson**2)
    depths = (0.03, 0.04, 0.05, 0.06)
    numbers = []
    for depth in depths:
        i = table["depths"].index(depth)
        x = math.log(100.0)
        load = table["c1"][i] * x**3 + table["c2"][i] * x**2 + table["c3"][i] * x + table["c4"][i]
        numbers.append(Reference(f"P/(h^2 Y) at h/R = {depth:g}", load, 0.04))

    def radius(grid):  # of the sphere; the contact at h/R = 0.06 has about 0.36 R
        return round(grid.contact / 0.36) * grid.cell

    def make(grid, directory):
        motion = Motion(0.066 * radius(grid), transits(grid, 6))
        return scene(
            "sphere into metal, E*/Y = 100",
            ["A sphere into perfectly plastic metal, E*/Y = 100, to 0.066 of its radius."],
            grid,
            [power_law(young / ratio, 0.0)],
            [grid.box("metal")],
            f"shape='sphere', radius={radius(grid):.10g}",
            motion,
            directory,
            effects=["&anti_locking /"],
            formats="none",
        )

    def measure(directory, grid):
        found = {}
        for depth, reference in zip(depths, numbers):
            h = depth * radius(grid)
            load, _ = measures.load_of_half_space(directory, grid, h)
            found[reference.name] = load / (h * h * young / ratio)
        return found | measures.kinetic(directory)

    return Row("B12", "sphere_plastic", "E*/Y = 100, n = 0", sharp_grids, make, measure, numbers)


# ---- B4, B5, B7, B8: elastic ----


def elastic_scene(title, tool, depth, count, grid, directory, materials=None, bodies=None, modulus=young):
    return scene(
        title,
        [f"{title}."],
        grid,
        materials or [elastic()],
        bodies or [grid.box("elastic")],
        tool,
        Motion(depth, transits(grid, count, modulus)),
        directory,
        formats="none",
    )


def pyramid_row(kind, name, what, angle=None):
    """An elastic pyramid, 'berkovich' (half model) or 'vickers' (quarter model): a blunt one of some half
    angle (degrees) beside the exact load of small strains, or the real one beside others' finite elements."""
    table = references["elastic_pyramid"]
    first, *others = table[kind]
    real = first * (1 + sum(c * poisson ** (i + 1) for i, c in enumerate(others)))
    usual = table[f"{kind}_half_angle"]
    slope = math.tan(math.radians(angle or usual))
    faces = "3" if kind == "berkovich" else "4"
    exact = table["exact"][faces]
    quantity, pressure = "P/(E'h^2 tan)" if angle else "P/(E'h^2)", "H tan/E', true area"
    kept = f"half_angle={angle or usual:g}"
    shape = f"shape='berkovich', {kept}" if kind == "berkovich" else f"shape='pyramid', faces=4, {kept}"
    grids = (
        pyramid_grids
        if kind == "berkovich"
        else {key: replace(grid, half=False) for key, grid in pyramid_grids.items()}
    )

    def depth(grid):  # the circle of equal area has the radius c h: S = 2 c E' h = 2 E' a
        return grid.contact * grid.cell / (real * slope / math.tan(math.radians(usual)))

    def make(grid, directory):
        title = f"{kind.title()} of {angle or usual:g} degrees, elastic"
        return elastic_scene(title, shape, 1.05 * depth(grid), 9, grid, directory)

    def measure(directory, grid):
        load, _ = measures.load_of_half_space(directory, grid, depth(grid))
        found = {quantity: load / (plane_modulus * depth(grid) ** 2) / (slope if angle else 1)}
        if angle:
            found[pressure] = measures.mean_pressure(directory) * slope / plane_modulus
        return found | measures.kinetic(directory)

    wanted = [Reference(quantity, exact if angle else real, 0.02)]
    if angle:
        wanted.append(Reference(pressure, table["exact_pressure"][faces], 0.04))
    return Row("B4", name, what, grids, make, measure, wanted)


def rounded_cone_row(name, shares):
    """A blunt cone whose tip is a sphere that touches it; contact radii of these shares of the tangent
    circle's, rising."""
    angle = math.radians(85.0)
    names = [f"P/(E'R^2) at a/b = {s:g}" for s in shares]

    def radius(grid):
        return grid.contact * grid.cell / (shares[-1] * math.cos(angle))

    def make(grid, directory):
        shape = f"shape='cone', half_angle={math.degrees(angle):g}, tip_radius={radius(grid):.10g}"
        depth = 1.05 * rounded_cone_depth(angle, shares[-1]) * radius(grid)
        return elastic_scene("rounded cone, elastic", shape, depth, 9, grid, directory)

    def measure(directory, grid):
        found = {}
        for name, share in zip(names, shares):
            load, _ = measures.load_of_half_space(
                directory, grid, rounded_cone_depth(angle, share) * radius(grid)
            )
            found[name] = load / (plane_modulus * radius(grid) ** 2)
        b = radius(grid) * math.cos(angle)
        loads = plane_modulus * radius(grid) ** 2 * exact([rounded_cone_depth(angle, s) for s in wider])
        return found | measures.area_of_load(directory, b * wider, loads) | measures.kinetic(directory)

    exact = rounded_cone(1.0, angle, 1.0)
    wider = np.linspace(1, 1.5 * shares[-1], 200)
    numbers = [
        Reference(name, float(exact(rounded_cone_depth(angle, s))), 0.02) for name, s in zip(names, shares)
    ] + [Reference(measures.area_name, 1.0, 0.02)]
    return Row("B6", name, f"85 degrees, to a/b = {shares[-1]:g}", sphere_grids, make, measure, numbers)


def sneddon(ratio):
    """h/R, F/(E'R^2) of a rigid sphere whose contact has this share of its radius."""
    log = math.log((1 + ratio) / (1 - ratio))
    return 0.5 * ratio * log, 0.5 * (1 + ratio**2) * log - ratio


def sneddon_row():
    shares = (0.15, 0.2)
    names = [f"F/(E'R^2) at a/R = {s:g}" for s in shares]

    def radius(grid):
        return grid.contact / shares[-1] * grid.cell

    def make(grid, directory):
        depth = 1.05 * sneddon(shares[-1])[0] * radius(grid)
        return elastic_scene(
            "sphere, elastic", f"shape='sphere', radius={radius(grid):.10g}", depth, 9, grid, directory
        )

    def measure(directory, grid):
        found = {}
        for name, share in zip(names, shares):
            load, _ = measures.load_of_half_space(directory, grid, sneddon(share)[0] * radius(grid))
            found[name] = load / (plane_modulus * radius(grid) ** 2)
        ratios = np.linspace(0.01, 1.5 * shares[-1], 200)
        loads = plane_modulus * radius(grid) ** 2 * np.array([sneddon(ratio)[1] for ratio in ratios])
        return (
            found
            | measures.area_of_load(directory, ratios * radius(grid), loads)
            | measures.kinetic(directory)
        )

    return Row(
        "B5",
        "sphere_elastic",
        "to a/R = 0.2",
        sphere_grids,
        make,
        measure,
        [Reference(name, sneddon(share)[1], 0.02) for name, share in zip(names, shares)]
        + [Reference(measures.area_name, 1.0, 0.02)],
    )


def crystal_row(surface):
    """An elastic sphere on a surface of a copper crystal; the quarter or half of it that mirrors of the
    crystal leave."""
    known = references["copper"]
    stiffness = anisotropic.cubic(*(known[name] for name in ("c11", "c12", "c44")))
    exact = anisotropic.sphere_modulus(stiffness, anisotropic.SURFACES[surface]) / 1e9
    grids = (
        pyramid_grids
        if surface == "111"
        else {key: replace(grid, half=False) for key, grid in pyramid_grids.items()}
    )
    axes = {"100": "0,0,0", "110": "0,45,0", "111": "90,54.7356103172453,45"}[surface]
    share = 0.15
    wave = known["c11"] * (1 + poisson) * (1 - 2 * poisson) / (1 - poisson)

    def radius(grid):
        return grid.contact / share * grid.cell

    def depth(grid):
        return share**2 * radius(grid)

    def make(grid, directory):
        material = (
            f"&material name='copper', model='cubic', density={density:g}, "
            + ", ".join(f"{name}={known[name]:g}" for name in ("c11", "c12", "c44"))
            + " /"
        )
        body = grid.box("copper").replace(" /", f", orientation={axes} /")
        shape = f"shape='sphere', radius={radius(grid):.10g}"
        return elastic_scene(
            f"sphere on ({surface}) of copper, elastic",
            shape,
            1.1 * depth(grid),
            14,
            grid,
            directory,
            [material],
            [body],
            wave,
        )

    def measure(directory, grid):
        base = anisotropic.base_compliance(stiffness, anisotropic.SURFACES[surface])
        load, _ = measures.load_of_half_space(directory, grid, depth(grid), exact * 1e9, base)
        return {
            "E' [GPa]": load / (4 / 3 * math.sqrt(radius(grid)) * depth(grid) ** 1.5) / 1e9
        } | measures.kinetic(directory)

    return Row(
        "B14", f"copper_{surface}", f"({surface})", grids, make, measure, [Reference("E' [GPa]", exact, 0.03)]
    )


sphere_over_layer = 5.0  # radius of the sphere over the layer's thickness
cone_angle = 88.0
punch_depth = 0.03  # over its radius


def layer_rows():
    table = references["layer_on_rigid_base"]
    punch = dict(table["punch"])
    sphere, cone = dict(table["sphere"]), dict(table["cone"])
    slope = math.tan(math.radians(cone_angle))

    def make_punch(grid, directory):
        radius = 0.4 * grid.thickness
        text = elastic_scene(
            "punch on a layer",
            f"shape='flat', radius={radius:.10g}",
            punch_depth * radius,
            20,
            grid,
            directory,
        )
        return one_per_cell(text, grid)

    def measure_punch(directory, grid):
        radius = 0.4 * grid.thickness
        load, _ = measures.load_at(directory, 0.95 * punch_depth * radius)
        return {
            "P/(2aE'd) at a/t = 0.4": load / (2 * radius * plane_modulus * 0.95 * punch_depth * radius)
        } | measures.kinetic(directory)

    def make_sphere(grid, directory):
        depth = 0.3568**2 * grid.thickness / sphere_over_layer
        radius = sphere_over_layer * grid.thickness
        return elastic_scene(
            "sphere on a layer", f"shape='sphere', radius={radius:.10g}", 1.05 * depth, 20, grid, directory
        )

    def measure_sphere(directory, grid):
        radius, found = sphere_over_layer * grid.thickness, {}
        for chi in (0.1884, 0.3568):
            depth = chi**2 * grid.thickness**2 / radius
            load, _ = measures.load_at(directory, depth)
            found[f"F/F_Hertz at sqrt(Rd)/t = {chi:g}"] = load / (
                4 / 3 * plane_modulus * math.sqrt(radius) * depth**1.5
            )
        return found | measures.kinetic(directory)

    def make_cone(grid, directory):
        depth = 0.5316 * grid.thickness / slope
        return elastic_scene(
            "cone on a layer", f"shape='cone', half_angle={cone_angle:g}", 1.05 * depth, 20, grid, directory
        )

    def measure_cone(directory, grid):
        found = {}
        for share in (0.2876, 0.5316):
            depth = share * grid.thickness / slope
            load, _ = measures.load_at(directory, depth)
            found[f"F/F_Love at d tan/t = {share:g}"] = load / (
                2 / math.pi * plane_modulus * slope * depth**2
            )
        return found | measures.kinetic(directory)

    return [
        Row(
            "B7",
            "layer_punch",
            "punch",
            punch_grids,
            make_punch,
            measure_punch,
            [Reference("P/(2aE'd) at a/t = 0.4", punch[0.4], 0.02)],
        ),
        Row(
            "B7",
            "layer_sphere",
            "sphere, R = 5 t",
            layer_grids,
            make_sphere,
            measure_sphere,
            [Reference(f"F/F_Hertz at sqrt(Rd)/t = {chi:g}", sphere[chi], 0.02) for chi in (0.3568, 0.1884)],
        ),
        Row(
            "B7",
            "layer_cone",
            f"cone of {cone_angle:g} degrees",
            layer_grids,
            make_cone,
            measure_cone,
            [Reference(f"F/F_Love at d tan/t = {share:g}", cone[share], 0.02) for share in (0.5316, 0.2876)],
        ),
    ]


def film_rows():
    """A film of ten times the substrate's modulus and others, under a punch and a sphere; a/t = 0.5."""
    table, share = references["film_on_substrate"], 0.5
    index = table["radii"].index(share)
    rows = []

    def thickness(grid):
        return grid.contact / share * grid.cell

    def bodies(grid):
        interface = grid.thickness - thickness(grid)
        return [grid.box("substrate", upper=interface), grid.box("film", lower=interface)]

    def base_of(grid):
        """Thickness of the block's substrate, in films."""
        return round((grid.thickness - thickness(grid)) / thickness(grid), 9)

    def row(shape, ratio, reference):
        key = f"{ratio:g}".replace(".", "_")
        # time counts in the slower of the two
        slower = young * min(1.0, 1 / ratio)
        materials = [elastic("film"), elastic("substrate", young / ratio)]
        label = "P/(2aE_f'd)" if shape == "flat" else "F/F_Hertz of the film"

        def make(grid, directory):
            t = thickness(grid)
            if shape == "flat":
                tool, depth = f"shape='flat', radius={share * t:.10g}", punch_depth * share * t
            else:
                radius = sphere_over_layer * t
                end, _ = depth_of_sphere(grid)
                tool, depth = f"shape='sphere', radius={radius:.10g}", 1.05 * end
            text = elastic_scene(
                f"{'punch' if shape == 'flat' else 'sphere'} on a film, E_f/E_s = {ratio:g}",
                tool,
                depth,
                9,
                grid,
                directory,
                materials,
                bodies(grid),
                slower,
            )
            return one_per_cell(text, grid) if shape == "flat" else text

        def depth_of_sphere(grid):
            """Depth and load (over the film's plane modulus) where the contact on the block has the radius of
            the table."""
            load, depth = layers_of(ratio, base_of(grid)).press(share, "sphere")
            t, over = thickness(grid), 2 * sphere_over_layer
            return depth / over * t, load / over * t * t

        def measure(directory, grid):
            t = thickness(grid)
            block, endless = layers_of(ratio, base_of(grid)), layers_of(ratio)
            if shape == "flat":
                depth = 0.95 * punch_depth * share * t
                load, _ = measures.load_at(directory, depth)
                raw = load / (2 * share * t * plane_modulus * depth)
                exact = stiffening(block, share, "flat")
            else:
                depth, _ = depth_of_sphere(grid)
                load, _ = measures.load_at(directory, depth)
                raw = load / (4 / 3 * plane_modulus * math.sqrt(sphere_over_layer * t) * depth**1.5)
                exact = stiffening(block, share, "sphere")
            on_endless = stiffening(endless, share, shape)
            return {
                label: raw * on_endless / exact,
                "base's share": exact / on_endless - 1,
            } | measures.kinetic(directory)

        return Row(
            "B8",
            f"film_{'punch' if shape == 'flat' else 'sphere'}_{key}",
            f"{'punch' if shape == 'flat' else 'sphere, R = 5 t'}, E_f/E_s = {ratio:g}",
            film_grids,
            make,
            measure,
            [Reference(label, reference, 0.02)],
        )

    for ratio, key in ((2.0, "2"), (0.5, "0_5"), (10.0, "10"), (0.1, "0_1")):
        rows.append(row("flat", ratio, table["punch"][key][index]))
        rows.append(row("sphere", ratio, table["sphere"][key][index]))
    return sorted(rows, key=lambda r: "sphere" in r.name)


# ---- impact ----


def impact_row():
    """A sphere with a mass strikes a layer of a known law of loads."""

    @lru_cache(maxsize=None)
    def problem(grid):
        """Radius of the sphere (m), depth (m), loads (N) over it up to a/t = 0.4, mass (kg), speed (m/s),
        time of contact (s)."""
        t, radius = grid.thickness, sphere_over_layer * grid.thickness
        layers = layers_of()
        pairs = [layers.press(0.4 * (i / 24), "sphere") for i in range(1, 31)]
        over = 2 * sphere_over_layer
        depths = [0.0] + [depth / over * t for _, depth in pairs]
        loads = [0.0] + [load / over * t * t * plane_modulus for load, _ in pairs]
        return radius, *measures.collision(depths, loads, 24, transits(grid, 24))

    def make(grid, directory):
        radius, mass, speed, _, _, time = problem(grid)
        return scene(
            "sphere strikes a layer",
            ["A rigid sphere with a mass strikes a layer and is thrown back."],
            grid,
            [elastic()],
            [grid.box("elastic")],
            f"shape='sphere', radius={radius:.10g}",
            None,
            directory,
            formats="none",
            pushed=(mass, speed, 1.15 * time),
        )

    def measure(directory, grid):
        _, _, speed, depth, load, time = problem(grid)
        found = measures.struck(directory)
        return {
            "largest depth over exact": found["depth"] / depth,
            "largest load over exact": found["load"] / load,
            "time of contact over exact": found["time"] / time,
            "speed back over speed": found["speed"] / speed,
        }

    return Row(
        "Impact",
        "impact",
        "sphere, R = 5 t",
        layer_grids,
        make,
        measure,
        [
            Reference("largest depth over exact", 1.0, 0.02),
            Reference("largest load over exact", 1.0, 0.02),
            Reference("time of contact over exact", 1.0, 0.02),
            Reference("speed back over speed", 1.0, 0.02),
        ],
    )


# ---- B13: time dependence ----

relaxation_time, relaxing = 1.0, 0.5  # s, and the part of both moduli that relaxes
press_time = 1.0  # s


def relaxing_row():
    """A sphere pressed into a viscoelastic layer and held there, in quasi-static steps. Poisson's ratio stays,
    so that the load is the layer's elastic one, whose growth is weighed by the relaxation function (Lee and
    Radok)."""
    share, times = 0.3568, (0.5, 1.0, 2.0, 3.0)
    names = [f"F/F_elastic at {time:g} s" for time in times]

    @lru_cache(maxsize=None)
    def elastic_loads():
        """Depths over that of the hold, and loads over (E' t^2), to a contact of 0.45 t."""
        layers, over = layers_of(), 2 * sphere_over_layer
        pairs = [layers.press(0.45 * i / 60, "sphere") for i in range(1, 61)]
        held = share**2 / sphere_over_layer
        depths = np.array([0.0] + [depth / over / held for _, depth in pairs])
        return depths, np.array([0.0] + [load / over for load, _ in pairs])

    def load_then(time):
        """Over (E' t^2)."""
        since = np.linspace(0, min(time, press_time), 4001)
        depths, loads = elastic_loads()
        # loads go with the depth to 1.5, about: straight lines between ratios to that
        ratio = loads[1:] / depths[1:] ** 1.5
        at = np.interp(since / press_time, depths[1:], ratio) * (since / press_time) ** 1.5
        middle = time - 0.5 * (since[1:] + since[:-1])
        left = 1 - relaxing * (1 - np.exp(-middle / relaxation_time))
        return float(np.sum(left * np.diff(at)))

    def elastic_end():
        depths, loads = elastic_loads()
        return float(np.interp(1.0, depths[1:], loads[1:] / depths[1:] ** 1.5))

    def make(grid, directory):
        radius = sphere_over_layer * grid.thickness
        depth = share**2 * grid.thickness**2 / radius
        material = (
            f"&material name='polymer', model='maxwell', density={density:g}, young={young:.10g}, "
            f"poisson={poisson:g},\n          relaxation_times={relaxation_time:g}, "
            f"shear_ratios={relaxing:g}, bulk_ratios={relaxing:g} /"
        )
        return scene(
            "sphere held in a viscoelastic layer",
            ["A sphere is pressed into a viscoelastic layer in one second and held."],
            grid,
            [material],
            [grid.box("polymer")],
            f"shape='sphere', radius={radius:.10g}",
            Held(depth, press_time, 3.05 * press_time),
            directory,
            effects=["&time domain='stretch' /\n&quasi_static step=0.05, max_step=0.05 /"],
            formats="none",
        )

    def measure(directory, grid):
        full = plane_modulus * grid.thickness**2 * elastic_end()
        return {name: measures.load_at_time(directory, time) / full for name, time in zip(names, times)}

    return Row(
        "B13",
        "relaxing",
        "sphere, R = 5 t",
        layer_grids,
        make,
        measure,
        [Reference(name, load_then(time) / elastic_end(), 0.02) for name, time in zip(names, times)],
    )


# ---- what other rows' runs say ----


def size_rows():
    line = next(r for r in references["cone"]["rows"] if r[0] == 100.0 and r[1] == 0.0)
    common = ("cone", "shape='cone', half_angle=70.3")
    one = sharp_row("Size", "size_1", "cells of 100 nm", *common, small_grids, line[0], 0.0, *line[2:])
    ten = sharp_row(
        "Size",
        "size_10",
        "ten times as large: over the small one's",
        *common,
        tenfold_grids,
        line[0],
        0.0,
        *line[2:],
    )
    one.references, names = [], [r.name for r in ten.references]
    ten.references = [Reference(name, 1.0, 1e-3) for name in names]

    def compare(directory, grid):
        large = measures.sharp(directory, grid, young / line[0])
        small = measures.sharp(
            Path(directory).parent / one.key(grid.name), small_grids[grid.name], young / line[0]
        )
        return {name: large[name] / small[name] for name in names} | {"kinetic": large["kinetic"]}

    ten.measure, ten.of = compare, (one,)
    return [one, ten]


def residual_rows():
    """Load, stiffness and hardness of a block under stress over those of one without."""
    line = next(r for r in references["cone"]["rows"] if r[0] == 100.0 and r[1] == 0.0)
    grids = {"coarse": replace(sharp_grids["coarse"], closed=True)}

    def row(name, what, share):
        tool = "shape='cone', half_angle=70.3"
        return sharp_row("Residual", name, what, "cone", tool, grids, line[0], 0.0, *line[2:], share=share)

    def over(one):
        def compare(directory, grid):
            here = measures.sharp(directory, grid, young / line[0])
            bare = measures.sharp(Path(directory).parent / one.key(grid.name), grid, young / line[0])
            return {n: here[n] / bare[n] for n in names} | {"kinetic": here["kinetic"]}

        return compare

    none = row("residual_none", "no stress", 0.0)
    names = ("C/Y", "S/(E'h)", "H/Y, true area")
    rows = [none]
    for name, what, share in (("pull", "pulled, 0.5 Y", 0.5), ("push", "pushed, -0.5 Y", -0.5)):
        one = row(f"residual_{name}", f"{what}: over that without", share)
        one.references = [Reference(names[2], 1.0, 0.02), Reference(names[0], 1.0), Reference(names[1], 1.0)]
        one.measure, one.of = over(none), (none,)
        rows.append(one)
    return rows


def analysis_rows():
    return [
        Row(
            "B10",
            f"analysis_{name}",
            name.replace("_", " "),
            measure=lambda directory, grid, name=name: measures.instrument(root, name),
            references=measures.instrument_references(root, name, Reference),
        )
        for name in ("fused_silica", "copper")
    ]


def error_rows(cones):
    """Oliver and Pharr's own error, in the runs of B1."""
    rows = []
    for ratio, hardness, modulus in references["oliver_pharr_error"]["rows"]:
        row = next(r for r in cones if r.name == f"cone_{round(ratio)}_0")
        rows.append(
            Row(
                "B11",
                f"error_{round(ratio)}",
                f"E/Y = {ratio:g}, n = 0",
                row.grids,
                None,
                lambda directory, grid, ratio=ratio: measures.error_of_oliver_pharr(directory),
                [
                    Reference("hardness too high by", hardness, 0.05, True),
                    Reference("modulus too high by", modulus, 0.05, True),
                ],
                of=(row,),
            )
        )
    return rows


def cases():
    cones, disks = cone_rows(), cone_rows("B1a", "disk", section_grids)
    lulu = (
        "Lu, Dao, Kumar, Ramamurty, Karniadakis, Suresh, PNAS 117 (2020) 7052, data/FEM_70deg.csv; "
        "finite elements"
    )
    layer = "exact integral equation ([layered.py](../../post/gimp3d/layered.py))"
    nested = "Block bonded to a rigid base, its sides 1.6 to 2 of its heights away, nested levels"
    return [
        Case(
            "B1",
            "Cone in metal that hardens",
            lulu
            + ", whose stiffness goes in steps of 3 %. Areas from S = 1.1957 E' sqrt(A) (Dao et al. 2001)",
            "Rigid cone of 70.3 degrees, frictionless, Poisson's ratio 0.3, Y (1 + E e/Y)^n as a table; in, "
            "held, drawn back. " + nested + "; depth and stiffness without what the base takes, q P/(E' t)",
            "Work that contact loses on the way (the error of the energy balance) counts as plastic: Wp/Wt "
            "comes out high where little is given back. C is of the load while the tool moves, "
            "at half of the flow stress over rho c at most. At E/Y = 700 the load falls by 5 % when the tool "
            "stands, to 91 Y h^2 (tool_tool.dat of the run); at four times the speed it falls by 14 % "
            "([notebook](../notebook/load_at_a_stop.md)), and at E/Y = 100 and 180 by 4 %. H is of the "
            "fallen load: in motion it is 3 to 4 % higher at E/Y = 100, n = 0, as the load is. "
            "The finite elements' own steps bound what can be said of the stiffness.",
            cones,
        ),
        Case(
            "B1a",
            "Cone in metal that hardens, by its section",
            lulu + ". As B1",
            "The ten rows of B1 with `geometry='axisymmetric'`: a disk bonded to a rigid base, in place of a "
            "square block. " + nested,
            "As B1. A grid more, for its price: the finest takes less time than the coarsest of B1.",
            disks,
        ),
        Case(
            "B2",
            "Berkovich in metal that hardens",
            lulu.replace("FEM_70deg", "Berkovich") + ", three-dimensional",
            "As B1 with a pyramid of 65.3 degrees, half model",
            "As B1. The three edges of the pyramid are sharp, and the grid rounds them. The table has no "
            "areas: those that H is compared with follow from its S with 1.237 E' sqrt(A), King's factor "
            "of a triangle and Hay's (Dao et al. 2001). The factor depends on the contact's shape. Before "
            "Hay's 1.06 it is 1.128 for a circle, 1.196 for a triangle and 1.323 for an elastic pyramid, "
            "whose faces sink in between its corners ([half_space.py](../../post/gimp3d/half_space.py) "
            "512). By these the areas of the reference are from 7 % too small (a circle, where metal "
            "piles up) over 5 % (a triangle) to 29 % too large (elastic). At E/Y = 25 the factor lies "
            "between the last two, by which H on the coarse grid is 3 % too high and 16 % too low. "
            "At E/Y = 100 the outline is nearly a triangle. H of E/Y = 700, fine, is by an earlier rule for "
            "the edge of the contact.",
            berkovich_rows(),
        ),
        Case(
            "B2c",
            "The cone of equal area in the metals of B2",
            lulu + ". As B1",
            "The three metals of B2 under B1's cone of 70.3 degrees, whose area at a depth is that of the "
            "pyramid, by the section. " + nested,
            "As B1. What finite elements say of pyramid over cone is 0.963 to 1.039 for C, 0.970 to 1.066 "
            "for S.",
            equal_cone_rows(disks),
        ),
        Case(
            "B1s",
            "Cone in metal, quasi-static",
            lulu + ". As B1",
            "Three rows of B1 in `&quasi_static` steps of a sixteenth of a cell; in, at rest, drawn back",
            "Loads without inertia or speed. Where metal flows, C comes out low by long steps: by several "
            "per cent at a quarter of a cell ([notebook](../notebook/static_metal.md)).",
            static_rows(),
        ),
        Case(
            "B4",
            "Berkovich and Vickers, elastic",
            "blunt: Boussinesq's integral, small strains "
            "([half_space.py](../../post/gimp3d/half_space.py)); real half angles: Larsson et al., "
            "Int. J. Solids Struct. 33 (1996) 221, and Giannakopoulos et al., ibid. 31 (1994) 2679, finite "
            "elements, as in NIMS's models",
            nested
            + ", half model, of Vickers' a quarter. For small strains the load goes with the tangent of the "
            "angle between axis and "
            "face. The real ones lie above that, as their surface moves sideways too (a cone by 6.7 %, Hay "
            "et al. 1999); the finite elements by 5.7 and 5.6 %",
            "Cells to the radius of the contact, whose corners are narrower than cells. H is that of the "
            "contact_area of the history, in the last fifth of the way.",
            [
                pyramid_row("berkovich", "pyramid_85", "three faces, 85 degrees", 85.0),
                pyramid_row("berkovich", "pyramid_65", "Berkovich, 65.27 degrees"),
                pyramid_row("vickers", "vickers_85", "four faces, 85 degrees", 85.0),
                pyramid_row("vickers", "vickers_68", "Vickers, 68 degrees"),
            ],
        ),
        Case(
            "B5",
            "Sphere, elastic",
            "Sneddon, Int. J. Engng Sci. 3 (1965) 47: exact for small strains",
            nested + "; loads at the depth of a half-space, q P/(E' t) added for the base",
            "Cells to the radius of the contact; strains that are not small (a/R = 0.2) add to it.",
            by_section([sneddon_row()], lambda row: flat_sphere_grids),
        ),
        Case(
            "B6",
            "Rounded cone, elastic",
            "Briscoe, Sebastian, Adams, J. Phys. D 27 (1994) 1156: exact for small strains",
            nested
            + "; a blunt cone, b the radius of the circle where its sphere goes over into it; loads at the "
            "depth of a half-space",
            "As B5. The true area is compared with that of the exact contact under the same load "
            "([theory](../developer/theory.md), eq. edge-field).",
            by_section(
                [
                    rounded_cone_row("rounded_cone", (1.0, 1.5, 2.0)),
                    rounded_cone_row("rounded_cone_5", (3.0, 5.0)),
                ],
                lambda row: flat_sphere_grids,
            ),
        ),
        Case(
            "B7",
            "Layer bonded to a rigid base",
            layer,
            "The block is the layer, and its sides are three thicknesses away; frictionless tool, Poisson's "
            "ratio 0.3. The punch on "
            "one particle a cell, by its section on 2 x 2 "
            "([accuracy](accuracy.md#indentation-compared-with-finite-elements))",
            "Punch: its edge is singular, and stands within a cell (by the section 2.5 % where it is 0.6 "
            "of a cell beyond a node, 25.6 cells a radius; 0.9 % on one, 24). Sphere and cone: cells to the "
            "radius of "
            "the contact where it is small; the "
            "per cent that is left at the end is the same on both grids, so that it is not these, and what "
            "it is has not been found.",
            by_section(
                layer_rows(), lambda row: flat_punch_grids if row.grids is punch_grids else flat_layer_grids
            ),
        ),
        Case(
            "B8",
            "Film on a substrate",
            layer,
            "Two bodies that touch, and so share one velocity field: bonded. a/t = 0.5. Our substrate is "
            "nine films deep, on a rigid "
            "base; numbers are divided by what the same equation says of that depth, over that of a "
            "half-space",
            "As B7; and the interface lies between particles, within one cell.",
            by_section(film_rows(), lambda row: flat_film_grids),
        ),
        Case(
            "B10",
            "The analysis itself",
            "Numbers of an instrument "
            "([test/references/oliver_pharr.toml](../../test/references/oliver_pharr.toml))",
            "No run: `post/gimp3d/oliver_pharr.py` with the instrument's coefficients",
            "None: the digits that the instrument prints.",
            analysis_rows(),
        ),
        Case(
            "B11",
            "Oliver and Pharr's own error",
            "The table of B1 with the ideal area function: what the analysis makes of exact curves. "
            "Bolshakov, Pharr, J. Mater. Res. 13 (1998) 1049",
            "The runs of B1. Hardness and modulus by the area of Oliver and Pharr, over those by the true "
            "area",
            "This is no error of the program but that of the analysis: the surface piles up, and the ideal "
            "area function does not know. It comes "
            "out too small where our pile-up, and with it the area, is smaller than the table's (B1).",
            error_rows(cones),
        ),
        Case(
            "B12",
            "Sphere in metal",
            "Cao, Lu, Acta Mater. 52 (2004) 4023: a fit to finite elements, as others coded it; not checked "
            "against the paper",
            nested + "; perfectly plastic, E*/Y = 100",
            "The fit's own error is not known.",
            by_section([sphere_plastic_row()], lambda row: section_grids),
        ),
        Case(
            "B13",
            "Sphere held in a viscoelastic layer",
            "exact: Lee, Radok, J. Appl. Mech. 27 (1960) 438, with the elastic loads of "
            "[layered.py](../../post/gimp3d/layered.py)",
            "A rigid sphere is pressed into the layer of B7 in one second and held for two, in quasi-static "
            "steps of 50 ms; half of both moduli relaxes with one time of one second (`maxwell`). Loads are "
            "over the elastic one at the depth that is kept",
            "As B7, and steps in time.",
            by_section([relaxing_row()], lambda row: flat_layer_grids),
        ),
        Case(
            "B14",
            "Sphere on a crystal, elastic",
            "exact integral of Barnett and Lothe, and the ellipse of contact "
            "([anisotropic.py](../../post/gimp3d/anisotropic.py)), after "
            "Vlassak and Nix, J. Mech. Phys. Solids 42 (1994) 1223",
            nested
            + ", a quarter or (111) half model; copper of c11, c12, c44 = 170, 124, 75 GPa as `cubic`; to "
            "a/R = 0.15",
            "Cells to the radius of the contact, as B5. What the base takes is that of a layer of the "
            "crystal, exact for a small contact: q = 0.411, 0.543, 0.590 on (100), (110), (111). These rows "
            "are of the program without the compliance below a cell (`&contact subcell=0`).",
            [crystal_row(surface) for surface in anisotropic.SURFACES],
        ),
        Case(
            "Impact",
            "Impact of a sphere",
            layer + ": the energy of its loads over depth",
            "A rigid sphere with a mass strikes the layer of B7, slowly beside the waves in it",
            "Some energy stays in the layer as waves: the sphere comes back slower. The rest as B7.",
            by_section([impact_row()], lambda row: flat_layer_grids),
        ),
        Case(
            "Size",
            "Size independence",
            "exact: no law here knows a length",
            "A small form of B1 (E/Y = 100, n = 0), and the same with all lengths and times times ten",
            "Round-off: the ratio of the two should be 1.",
            size_rows(),
        ),
        Case(
            "Residual",
            "Residual stress",
            "Tsui, Oliver, Pharr, J. Mater. Res. 11 (1996) 752; Bolshakov et al., ibid. 760: with the true "
            "area the hardness does not depend on a stress in the surface",
            "B1 (E/Y = 100, n = 0), the block between symmetry sides, so that it may be under an equal "
            "stress along both its sides",
            "The load at a depth changes with the stress, and the area with it.",
            residual_rows(),
        ),
    ]


not_yet = [
    (
        "B3",
        "experiments in aluminium: a row like those of B1, whose references carry the diamond's give; not "
        "made yet",
    ),
    ("B9", "no adhesion"),
    ("B14, plastic", "not a case of the book yet; pile-up of crystals is `indentation/crystal_long`"),
    ("B15", "tools do not move across their axis"),
]
