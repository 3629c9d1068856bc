"""The book of benchmarks without a run of the program. usage: benchmarks.py ROOT WORK"""

import contextlib
import io
import json
import math
import os
import re
import shutil
import sys
from pathlib import Path

import numpy as np

ROOT, WORK = Path(sys.argv[1]), Path(sys.argv[2])
from gimp3d import anisotropic
from gimp3d import benchmark_cases as cases
from gimp3d import benchmark_measures as measures
from gimp3d import benchmarks
from gimp3d import half_space
from gimp3d import hardness as hardness_of_runs
from gimp3d import indentation
from gimp3d.benchmark_scenes import Motion, plane_modulus, poisson, power_law, young
from gimp3d.layered import Layers, base_compliance, compliance, stiffening
from gimp3d.scene_text import Scene
from checks import finish, near, require


tables = cases.references

# ---- layers: post/gimp3d/layered.py beside numbers of another program ----

table = tables["layer_on_rigid_base"]
worst = 0.0
for key, nu in (("punch", 0.3), ("punch_0", 0.0), ("punch_4", 0.4)):
    layers = Layers(nu)
    worst = max(worst, max(abs(stiffening(layers, a, "flat") / value - 1) for a, value in table[key]))
require(f"punch on a layer, at three Poisson's ratios: {worst:.1e}", worst < 1e-4)
layers = cases.layers_of()
for shape, over in (("sphere", lambda d: math.sqrt(d / 2)), ("cone", lambda d: d)):
    found = []
    for radius in np.geomspace(0.02, 1.6, 40):
        load, depth = layers.press(radius, shape)
        found.append((over(depth), stiffening(layers, radius, shape)))
    at = np.array(found)
    curve = np.interp([x for x, _ in table[shape]], at[:, 0], at[:, 1])
    worst = max(abs(value / exact - 1) for value, (_, exact) in zip(curve, table[shape]))
    require(f"{shape} on a layer: {worst:.1e}", worst < 1.5e-3)
table = tables["film_on_substrate"]
worst = 0.0
for shape in ("punch", "sphere"):
    for key, values in table[shape].items():
        film = cases.layers_of(float(key.replace("_", ".")))
        for radius, value in zip(table["radii"], values):
            worst = max(worst, abs(stiffening(film, radius, "flat" if shape == "punch" else shape) - value))
require(f"film on a substrate, all of the table: {worst:.1e}", worst < 1.1e-4)
require(
    "a film that is as its substrate is a half-space",
    near(stiffening(Layers(poisson, 1.0, poisson), 0.5, "sphere"), 1.0, 1e-6),
)
require(
    "a film that is as its substrate, of 3 films on a rigid base, is a layer of 4",
    near(stiffening(Layers(poisson, 1.0, poisson, 3.0), 0.4, "flat"), stiffening(layers, 0.1, "flat"), 2e-4),
)
require(
    "a deep base is a half-space, a shallow one is not",
    near(stiffening(Layers(poisson, 2.0, poisson, 1e4), 0.5, "flat"), 0.7562, 3e-4)
    and stiffening(Layers(poisson, 2.0, poisson, 9.0), 0.5, "flat") > 1.05 * 0.7562,
)
# one that slides: a plate on a half-space where waves are long (plane modulus 1: t^3 / 12), its own
# half-space where they are short
worst = max(
    abs(compliance(x, poisson, ratio, slides=True) / (0.5 * x / (x**4 / 12 + 0.5 * x / ratio)) - 1)
    for x, ratio in ((0.02, 10.0), (0.05, 10.0), (0.02, 1e3), (0.03, 2.0))
)
require(f"a film that slides is a plate under long waves: {worst:.1e}", worst < 0.02)
require("and a half-space under short ones", near(compliance(20.0, poisson, 10.0, slides=True), 1.0, 1e-9))
require(
    "a deep base under a film that slides is a half-space",
    near(
        compliance(0.5, poisson, 10.0, 0.3, 100.0, slides=True),
        compliance(0.5, poisson, 10.0, slides=True),
        1e-9,
    ),
)
require(
    "a film that slides is softer than one that is bonded",
    stiffening(Layers(poisson, 10.0, slides=True), 0.5, "flat")
    < 0.95 * stiffening(cases.layers_of(10.0), 0.5, "flat"),
)
give = base_compliance(poisson)
require(
    "what a base takes off the depth, beside a small punch",
    near(1 - 1 / stiffening(layers, 0.02, "flat"), give * 2 * 0.02, 1e-2),
)
require("another Poisson's ratio is not met", not near(stiffening(Layers(0.4), 0.4, "flat"), 1.4726, 1e-2))

# ---- formulas and numbers of references ----

known = tables["sneddon_sphere"]
depth, load = cases.sneddon(known["radius"])
require("Sneddon's sphere", near(depth, known["depth"], 2e-5) and near(load, known["load"], 1e-5))
require("and Hertz is 2.8 % above it", near(4 / 3 * depth**1.5 / load, 1.028, 1e-3))
known = tables["rounded_cone"]
angle = math.radians(known["half_angle"])
for share, depth, load in known["rows"]:
    ours = indentation.rounded_cone_depth(angle, share)
    require(
        f"a rounded cone at a/b = {share}",
        near(ours, depth, 5e-5) and near(float(indentation.rounded_cone(1.0, angle, 1.0)(ours)), load, 5e-5),
    )
first, *others = tables["elastic_pyramid"]["berkovich"]
require(
    "Berkovich, elastic, 2.0250",
    near(first * (1 + sum(c * 0.3 ** (i + 1) for i, c in enumerate(others))), 2.0250, 3e-5),
)
first, *others = tables["elastic_pyramid"]["vickers"]
require(
    "Vickers, elastic, 1.9287",
    near(first * (1 + sum(c * 0.3 ** (i + 1) for i, c in enumerate(others))), 1.9287, 3e-5),
)
solved = {
    faces: [half_space.curvature(faces, points) for points in (64, 128)] for faces in (0, 3, 4)
}  # load, area
pressed = {faces: fine[0] for faces, (_, fine) in solved.items()}
mean = {faces: fine[0] / (2 * fine[1] - coarse[1]) for faces, (coarse, fine) in solved.items()}
require("half-space: a cone, 2/pi", near(pressed[0], 2 / math.pi, 1e-4))
require("half-space: a cone's mean pressure, 1/2", near(mean[0], 0.5, 5e-3))
exact, over_area = (tables["elastic_pyramid"][key] for key in ("exact", "exact_pressure"))
require(
    "half-space: pyramids of three and four faces",
    all(near(pressed[n], exact[str(n)], 3e-4) and near(mean[n], over_area[str(n)], 5e-3) for n in (3, 4)),
)
punches = {faces: half_space.punch_stiffness(faces, 160) for faces in (0, 3, 4)}
require("half-space: a round punch, 2/sqrt(pi)", near(punches[0], 2 / math.sqrt(math.pi), 5e-3))
require(
    "half-space: corners make a punch of the same area stiffer",
    punches[0] < punches[4] < punches[3] < 1.1 * punches[0],
)
at = (np.arange(96) + 0.5) / 40 - 1.2
across = np.hypot(*np.meshgrid(at, at))
require(
    "half-space: a sphere, Hertz",
    near(half_space.press(across**2 / 2, 0.025, 1.0).sum() * 0.025**2, 4 / 3, 1e-4),
)
require(
    "half-space: a punch of unit radius, 2",
    near(half_space.press(np.where(across < 1, 0.0, 9.0), 0.025, 1.0).sum() * 0.025**2, 2, 6e-3),
)
stiff = anisotropic.cubic(
    young * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson),
    young * poisson / (1 + poisson) / (1 - 2 * poisson),
    young / 2 / (1 + poisson),
)
require(
    "anisotropic: an isotropic body",
    all(
        near(f(stiff, (1, 2, 3)), plane_modulus, 1e-9)
        for f in (anisotropic.punch_modulus, anisotropic.sphere_modulus)
    ),
)
crystal = anisotropic.cubic(*(tables["copper"][name] for name in ("c11", "c12", "c44")))


def by_eigenvectors(stiffness, along, normal):
    """Z of a direction as the decaying waves of Stroh's sextic give it."""
    q, r, t = (
        np.einsum("j,ijkl,l->ik", x, stiffness, y)
        for x, y in ((along, along), (along, normal), (normal, normal))
    )
    inverse = np.linalg.inv(t)
    matrix = np.block([[-inverse @ r.T, inverse], [r @ inverse @ r.T - q, -r @ inverse]])
    values, vectors = np.linalg.eig(matrix)
    used = vectors[:, values.imag > 0]
    return float((normal @ (1j * used[:3] @ np.linalg.inv(used[3:])) @ normal).real)


worst = 0.0
for normal in anisotropic.SURFACES.values():
    first, second, n = anisotropic.frame(normal)
    for angle in (0.1, 0.7, 1.9):
        way = math.cos(angle) * first + math.sin(angle) * second
        worst = max(
            worst, abs(anisotropic.compliance(crystal, way, n) / by_eigenvectors(crystal, way, n) - 1)
        )
require(f"anisotropic: compliance of copper by integrals and by eigenvectors, {worst:.1e}", worst < 1e-8)
moduli = [
    [f(crystal, n) for n in anisotropic.SURFACES.values()]
    for f in (anisotropic.punch_modulus, anisotropic.sphere_modulus)
]
require(
    "anisotropic: on (100) and (111) a sphere's contact is a circle, on (110) nearly",
    near(moduli[0][0], moduli[1][0], 1e-9)
    and near(moduli[0][2], moduli[1][2], 1e-9)
    and 1e-4 < moduli[1][1] / moduli[0][1] - 1 < 1e-2,
)
nearly = anisotropic.cubic(
    *(stiff[i] * f for i, f in (((0, 0, 0, 0), 1), ((0, 0, 1, 1), 1), ((0, 1, 0, 1), 1.0001)))
)
shares = [anisotropic.base_compliance(c, n, 6) for c, n in ((nearly, (0, 0, 1)), (crystal, (1, 1, 1)))]
require(
    "anisotropic: a bonded base under a nearly isotropic layer as exact layers have it, not so under (111) "
    f"of copper: {shares[0]:.4f}, {shares[1]:.4f}",
    near(shares[0], base_compliance(poisson), 1e-3) and shares[1] > 1.2 * shares[0],
)
require(
    "ten rows of the cone, three of the pyramid",
    (len(cases.cone_rows()), len(cases.berkovich_rows())) == (10, 3),
)
for ratio, hardness, modulus in tables["oliver_pharr_error"]["rows"]:
    line = next(r for r in tables["cone"]["rows"] if r[0] == ratio and r[1] == 0.0)
    true = (line[3] / tables["area_of_stiffness"]["cone"]) ** 2
    contact = 1 - 0.75 * line[2] / (line[3] * ratio / (1 - poisson**2))
    area = 24.5 * contact**2
    require(
        f"Oliver and Pharr at E/Y = {ratio:g}: hardness {true / area - 1:+.3f}, modulus "
        f"{math.sqrt(true / area) - 1:+.3f}",
        abs(true / area - 1 - hardness) < 1e-3 and abs(math.sqrt(true / area) - 1 - modulus) < 1e-3,
    )
for row in cases.analysis_rows():
    found = row.measure(None, None)
    for reference in row.references:
        require(
            f"{row.name}, {reference.name} to the digits", near(found[reference.name], reference.value, 2e-6)
        )

# what the edge of contact_area is off in the cones, of a cell
edges, book = [], json.loads((ROOT / "doc/user/benchmarks.json").read_text())
for row in cases.cone_rows():
    curvature, *_ = row.references
    hard = next(r for r in row.references if r.name == "H/Y, true area")
    for name, grid in row.grids.items():
        found = book.get(row.key(name), {"found": {}})["found"]
        if "H/Y, true area" in found:
            area = found["C/Y"] / found["H/Y, true area"] / (curvature.value / hard.value)
            edges.append((math.sqrt(area) - 1) * grid.contact)
rms = math.sqrt(np.mean(np.square(edges)))
require(
    f"the edge of contact_area in {len(edges)} cones: {rms:.2f} cells off, rms",
    len(edges) > 5 and 0.5 * hardness_of_runs.history_resolution < rms < hardness_of_runs.history_resolution,
)

# the same under elastic pyramids, whose corners are narrower than cells
edges = []
for row in (row for case in cases.cases() for row in case.rows):
    for reference in row.references:
        if reference.name != "H tan/E', true area":
            continue
        for name, grid in row.grids.items():
            found = book.get(row.key(name), {"found": {}})["found"].get(reference.name)
            if found is not None:
                edges.append((math.sqrt(reference.value / found) - 1) * grid.contact)
most = max(abs(edge) for edge in edges)
require(
    f"the edge of contact_area under {len(edges)} elastic pyramids: {most:.2f} cells off at most",
    len(edges) > 1 and most < hardness_of_runs.elastic_resolution,
)

# ---- scenes ----

for law, exponent in ((power_law(700e6, 0.3), 0.3), (power_law(100e6, 0.5), 0.5)):
    material = Scene(f"{law}\n").values()["material"][0]
    stress, strain = np.array(material["hardening_stress"]), np.array(material["hardening_strain"])
    between = np.geomspace(1e-4, 5, 400)
    exact = stress[0] * (1 + young * between / stress[0]) ** exponent
    off = float(np.max(np.abs(np.interp(between, strain, stress) / exact - 1)))
    require(f"the table of the power law {exponent:g} is within {off:.1e} of it", off < 5e-3)
for motion in (Motion(2e-7, 1e-8), Motion(2e-7, 1e-8, 0.5e-7)):
    times, speeds, end = motion.values()
    t = np.linspace(0, end, 200001)
    travel = np.r_[
        0, np.cumsum(0.5 * (np.interp(t, times, speeds)[1:] + np.interp(t, times, speeds)[:-1]) * np.diff(t))
    ]
    require("a tool goes as deep as it should", near(travel.max(), motion.depth, 1e-4))
    require("and comes back as far", abs(travel.max() - travel[-1] - motion.back) < 1e-4 * motion.depth)
for case in cases.cases():
    for row in case.rows:
        for grid in row.grids if row.make else ():
            scene = Scene(row.scene(grid)).values()
            own = row.grids[grid]
            top = own.thickness
            sizes = [scene["grid"][0]["cell_size"][0] / 2 ** (i + 1) for i in range(len(own.boxes))]
            if not (near(sizes[-1], own.cell, 1e-9) and near(scene["tool"][0]["tip"][2], top, 1e-9)):
                require(f"{row.key(grid)}: the finest cells, the tip", False)
require("all rows have a scene on each grid", True)

# ---- what is read off runs ----

hertz = np.linspace(0, 1e-7, 31)
constant = 4 / 3 * plane_modulus * math.sqrt(10e-6)
mass, speed, top, load, time = measures.collision(list(hertz), list(constant * hertz**1.5), 24, 1e-8)
require("Hertz's impact: time of contact", near(time, 2.9432 * top / speed, 2e-4))
require("Hertz's impact: depth", near(0.5 * mass * speed**2, 0.4 * constant * top**2.5, 1e-4))

depth, level = np.linspace(0, 1e-7, 400), 3e13
for noise in (0.0, 0.01):
    wave = 1 + noise * np.sin(np.arange(400) * 2.1)
    value, sigma = measures.smooth_load(depth, level * depth**1.5 * wave, 0.9e-7)
    require(
        f"a load at a depth, waves of {100 * noise:g} %", near(value, level * 0.9e-7**1.5, 1e-4 + 0.2 * noise)
    )

grid = cases.sharp_grids["coarse"]
half = {"depth": 2e-7, "C": 60e9, "S": 6.0 * plane_modulus * 2e-7, "elastic": 0.2, "work": 60e9 * 8e-21 / 3}
give = base_compliance(poisson) / (plane_modulus * grid.thickness)
load = half["C"] * half["depth"] ** 2
stored = 0.5 * give * load**2
held = measures.analysed
measures.analysed = lambda directory: {
    "loading_curvature": load / (half["depth"] - give * load) ** 2,
    "max_depth": half["depth"] - give * load,
    "max_load": load,
    "stiffness": 1 / (1 / half["S"] - give),
    "stiffness_uncertainty": 0.0,
    "work_total": half["work"] - stored,
    "work_elastic": half["elastic"] * half["work"] - stored,
    "work_ratio": 0.8,
    "loading_exponent": 2.0,
    "kinetic_share": 0.001,
    "area_true": 1e-12,
    "hardness_true": load / 1e-12,
    "missing": [],
}
found = measures.sharp("x", grid, 1e9)
measures.analysed = held
require(
    "curvature, stiffness, work of a half-space from those of a block",
    near(found["C/Y"], 60, 1e-9) and near(found["S/(E'h)"], 6.0, 1e-9) and near(found["Wp/Wt"], 0.8, 1e-9),
)
require("and the base's share is some per cent", 0.01 < -found["base's share"] < 0.06)

# ---- tables ----


def dat(path, columns, rows, note):
    names = " ".join(f'"{name}"' for name in columns)
    path.write_text(
        f'TITLE = "fabricated"\nVARIABLES = {names}\nZONE T="history", STRANDID=1, SOLUTIONTIME=0\nAUXDATA '
        f'{note}\n' + "".join(" ".join(f"{value:.10e}" for value in row) + "\n" for row in rows)
    )


def fabricate(row, grid, factor):
    """A run of the sphere on a layer, as the exact loads have it, times a factor."""
    directory = Path(row.directory(grid))
    shutil.rmtree(directory, ignore_errors=True)
    directory.mkdir(parents=True)
    text, own = row.scene(grid), row.grids[grid]
    (directory / "case.nml").write_text(text)
    layers, t, over = cases.layers_of(), own.thickness, 2 * cases.sphere_over_layer
    pairs = np.array([layers.press(a, "sphere") for a in np.linspace(0.01, 0.5, 60)])
    depth = np.linspace(0, 1.05 * 0.3568**2 * t / cases.sphere_over_layer, 500)
    load = factor * np.interp(depth, pairs[:, 1] / over * t, pairs[:, 0] / over * t * t * plane_modulus) / 4
    time, zero = np.linspace(0, 1e-8, 500), np.zeros(500)
    names = [
        "time [s]",
        "depth [m]",
        "load_x [N]",
        "load_y [N]",
        "load_z [N]",
        "contact_area [m2]",
        "max_gap_violation [m]",
    ]
    dat(
        directory / "tool_tool.dat",
        names,
        np.c_[time, depth, zero, zero, load, zero, zero],
        'model_share="0.25"',
    )
    work = np.r_[0, np.cumsum(load[1:] * np.diff(depth))]
    dat(
        directory / "energy.dat",
        ["time [s]", "kinetic [J]", "external_work [J]"],
        np.c_[time, 0.004 * work, work],
        'model="part"',
    )
    record = {
        "scene": benchmarks.digest(text),
        "program": "made up",
        "version": "0",
        "ranks": 2,
        "seconds": 12.0,
        "particles": 1,
        "fault": "",
        "end": "finished: ",
    }
    (directory / "benchmark.json").write_text(json.dumps(record))
    measures.record_of.cache_clear()


def written(*names):
    """The document after `make benchmarks` of rows, nothing being run."""
    with contextlib.redirect_stdout(io.StringIO()):
        status = benchmarks.main(["--no-run", "--document", "book.md", *names])
    require(f"status 0 for {' '.join(names)}", status == 0)
    return Path("book.md").read_text()


os.chdir(WORK)
Path("book.md").write_text(
    "# "
    f"Head\n\nKept.\n\n{benchmarks.benchmark_table.first}\nold\n{benchmarks.benchmark_table.last}\n\nFoot.\n"
)
row = next(r for r in cases.layer_rows() if r.name == "layer_sphere")


def line_of(text):
    return next(
        (
            line
            for line in text.splitlines()
            if line.startswith("| sphere, R = 5 t | F/F_Hertz") and "coarse (8)" in line
        ),
        "",
    )


text = written("layer_sphere")
names = " ".join(f"layer_{shape} layer_{shape}_section" for shape in ("punch", "sphere", "cone"))
said = f'CASES="{names}" GRIDS=coarse' in " ".join(text.split())
require("a row that was not run is said to be so, with the command", said and not line_of(text))
require(
    "what stands around the tables stays",
    text.startswith("# Head\n\nKept.\n") and text.endswith("\n\nFoot.\n") and "old" not in text,
)
fabricate(row, "coarse", 1.0)
line = line_of(written("layer_sphere", "B10"))
cells = [cell.strip() for cell in line.split("|")]
print(f"   {line}")
require("the exact loads have no error", len(cells) > 6 and abs(float(cells[6].split()[0])) < 0.1)
require("kinetic energy, time and ranks stand there", "| 0.4 | 12, 2 |" in line)
fabricate(row, "coarse", 1.1)
text = written("layer_sphere")
require("loads that are 10 % too high are said to be so", "+10 %" in line_of(text))
require(
    "the summary counts them",
    re.search(r"^\| \[B7\].*\| 1 of 6 \| 0 of 2 \| \+10 % ", text, re.M) is not None,
)
require(
    "what was not measured again stays",
    re.search(r"^\| \[B10\].*\| 2 of 2 \| 4 of 4 \|", text, re.M) is not None,
)
stored = json.loads(Path("book.json").read_text())
stored["layer_cone_coarse"] = {
    "fault": "step 7: it burst",
    "scene": benchmarks.digest(cases.layer_rows()[2].scene("coarse")),
}
stored["layer_sphere_coarse"]["scene"] = "another"
Path("book.json").write_text(json.dumps(stored))
shutil.rmtree(row.directory("coarse"))
text = written("layer_sphere")
require("numbers of another scene are not taken", not line_of(text))
require(
    "a run that ended early is said to have none",
    "coarse grid, has no numbers: step 7: it burst" in " ".join(text.split()),
)
wide = [line for line in text.splitlines() if len(line) > 110 and not line.startswith(("|", "#"))]
require("prose has at most 110 columns", not wide)

finish()
