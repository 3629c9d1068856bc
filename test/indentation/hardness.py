"""post/gimp3d/hardness.py on fabricated runs. usage: hardness.py ROOT WORK

A cone of 70.3 degrees goes 200 nm into a block, P = C h^2, and comes back along a (h - h_f)^m. The contact
has a radius of 1.1 h tan: the surface piles up to 0.1 h and falls off outside as a wedge does.
"""

import contextlib
import csv
import io
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

ROOT, WORK = Path(sys.argv[1]), Path(sys.argv[2])
from gimp3d import hardness
from gimp3d import imprint
from gimp3d import oliver_pharr as op
from gimp3d import systematic
from gimp3d.identification.measured import read_curve
from checks import finish, near, require

angle, young, poisson, top = math.radians(70.3), 70e9, 0.3, 4e-6
deepest, final, exponent, load = 200e-9, 175e-9, 1.4, 2e-3
factor = load / (deepest - final) ** exponent
stiffness = factor * exponent * (deepest - final) ** (exponent - 1)
beta, epsilon = op.hay_factor(70.3, poisson), op.epsilon_of_exponent(exponent)
edge = deepest - epsilon * load / stiffness
nominal = math.pi * (edge * math.tan(angle)) ** 2
radius = 1.1 * deepest * math.tan(angle)
true = math.pi * radius**2
back = factor * (deepest - final) ** (exponent + 1) / (exponent + 1)
exact = {
    "max_depth": deepest,
    "max_load": load,
    "loading_curvature": load / deepest**2,
    "stiffness": stiffness,
    "residual_depth": final,
    "contact_depth": edge,
    "area_oliver_pharr": nominal,
    "area_true": true,
    "hardness_oliver_pharr": load / nominal,
    "hardness_true": load / true,
    "modulus_oliver_pharr": op.reduced_modulus(stiffness, nominal, beta),
    "modulus_true": op.reduced_modulus(stiffness, true, beta),
    "work_ratio": 1 - back / (load * deepest / 3),
    "pile_up": 0.1 * deepest,
}


def heights(r, depth, unloaded, rise=0.1):
    """Height of the surface above the undeformed one: the tool's within the contact, whose edge stands `rise`
    of the depth above it, a wedge that falls off outside; unloaded shallower by a tenth of the depth, but 0
    far away."""
    a = (1 + rise) * depth * math.tan(angle)
    if a == 0:
        return 0 * r
    outside = rise * depth * np.exp(-(r - a) / (0.4 * a))
    return np.where(r < a, (r - a) / math.tan(angle) * (0.9 if unloaded else 1.0) + rise * depth, outside)


def particle_file(path, time, depth, unloaded, share, fine, rise):
    """Three layers of particles at the surface, cells of 120 nm with two a side; `fine`: half that within 0.8
    um, with domains."""
    low = {1.0: (-1, -1), 0.5: (0, -1), 0.25: (0, 0)}[share]
    points, halves = [], []
    for half, inner in ((15e-9, True), (30e-9, False)) if fine else ((30e-9, None),):
        sides = [np.arange(-2.04e-6 * -side + half if side else half, 2.04e-6, 2 * half) for side in low]
        x, y = np.meshgrid(*sides, indexing="ij")
        x, y = x.ravel(), y.ravel()
        within = np.maximum(abs(x), abs(y)) < 0.84e-6
        keep = within if inner else ~within if inner is False else np.full(x.size, True)
        x, y = x[keep], y[keep]
        surface = heights(np.hypot(x, y), depth, unloaded, rise)
        for layer in range(3):
            points.append(np.stack([x, y, top + surface - (2 * layer + 1) * half], axis=1))
            halves.append(np.full(x.size, half))
    points, halves = np.concatenate(points), np.concatenate(halves)
    order = np.random.default_rng(3).permutation(len(points))
    points, halves = points[order], halves[order]
    with h5py.File(path, "w") as file:
        file.attrs["time"] = time
        group = file.create_group("VTKHDF")
        group["Points"] = points
        group["PointData/id"] = np.arange(len(points)) + 1
        group["PointData/body"] = np.ones(len(points))
        inside = np.hypot(points[:, 0], points[:, 1]) < radius
        group["PointData/contact_pressure"] = np.where(inside, load / true, 0.0)
        for number, name in enumerate(("xx", "yy", "zz", "yz", "xz", "xy"), 1):
            table = group.create_dataset(
                f"PointData/stress_{name}", data=np.where(inside, -load / true if name == "zz" else 0.0, 0.0)
            )
            table.attrs["component_of"], table.attrs["component"] = "stress", number
        if fine:
            group["PointData/domain"] = (halves[:, None, None] * np.eye(3)[[1, 2, 0]]).reshape(-1, 9)
        else:
            group["PointData/half_size"] = halves[:, None]


def inward(rows):
    depth = np.linspace(0, deepest, rows)
    return depth, load * (depth / deepest) ** 2


def outward(rows, to=0.0):
    depth = np.linspace(deepest, final + to * (deepest - final) - (0 if to else 5e-9), rows)[1:]
    return depth, factor * np.maximum(depth - final, 0) ** exponent


def partial_unloads():
    """Depth and load with ways back to a third of the load from 80, 140 and 200 nm; all of the same form."""
    depth, force = [np.zeros(1)], [np.zeros(1)]
    start = 0.0
    for reached in (80e-9, 140e-9, 200e-9):
        size = reached / deepest
        h = np.linspace(start, reached, 150)[1:]
        end = size * (final + 0.4 * (deepest - final))
        b = np.linspace(reached, end, 150)[1:]
        way_back = size**2 * load * ((b / size - final) / (deepest - final)) ** exponent
        way_in = size**2 * load * (np.maximum(b[::-1] / size - final, 0) / (deepest - final)) ** exponent
        depth += [h, b] + ([b[::-1][1:]] if reached < 200e-9 else [])
        force += [load * (h / deepest) ** 2, way_back] + ([way_in[1:]] if reached < 200e-9 else [])
        start = reached
    return np.concatenate(depth), np.concatenate(force)


def fabricate(
    name,
    share=0.25,
    gap=0.0,
    curve=None,
    tools=("cone",),
    shape="shape='cone', half_angle=70.3,",
    snapshots=True,
    fine=False,
    snapshot_at=None,
    kinetic=0.002,
    model_share=True,
    area_share=1.0,
    rise=0.1,
    beside="",
):
    """A run's directory: what a program with the exact answers would have written."""
    directory = WORK / name
    directory.mkdir()
    low = {1.0: (-2.04e-6, -2.04e-6), 0.5: (0.0, -2.04e-6), 0.25: (0.0, 0.0)}[share]
    sides = ["symmetry" if x == 0 else "free" for x in low]
    groups = "".join(
        f"&tool name='{tool}', {shape} tip=0,0,{top + gap}, axis=0,0,-1, times=0,1, speeds=1,1 /\n"
        for tool in tools
    )
    (directory / "case.nml").write_text(f"""&scene title='fabricated', end_time=1e-6 /
&grid lower={low[0]},{low[1]},0, upper=2.04e-6,2.04e-6,5e-6, cell_size=1.2e-7, boundary='{sides[0]}','free','{sides[1]}','free','roller','free' /
&material name='alloy', model='j2', density=2710, young={young}, poisson={poisson}, yield_stress=7e8 /
&body material='alloy', shape='box', lower={low[0]},{low[1]},0, upper=2.04e-6,2.04e-6,{top}, particles_per_cell=8 /
{beside}{groups}""")
    if curve is None:
        (h, p), (hb, pb) = inward(400), outward(200)
        curve = np.r_[h, hb], np.r_[p, pb]
    depth, force = curve
    time = np.linspace(0, 1e-6, depth.size)
    peak = int(np.argmax(depth))
    area = math.pi * (1.1 * np.maximum(depth, 0) * math.tan(angle)) ** 2
    area[peak:] = np.where(force[peak:] > 0, area[peak], 0)
    note = f'AUXDATA model_share="{share}"\n' if model_share else ""
    names = (
        '"time [s]" "depth [m]" "load_x [N]" "load_y [N]" "load_z [N]" '
        '"contact_area [m2]" "max_gap_violation [m]"'
    )
    for tool in tools:
        rows = np.c_[
            time, depth + gap, 0 * time, 0 * time, share * force, share * area_share * area, 0 * time
        ]
        (directory / f"tool_{tool}.dat").write_text(
            f'TITLE = "fabricated"\nVARIABLES = {names}\nZONE T="history", STRANDID=1, SOLUTIONTIME=0\n{note}'
            + "".join(" ".join(f"{value:.16e}" for value in row) + "\n" for row in rows)
        )
    work = np.r_[0, np.cumsum(np.diff(depth) * (force[1:] + force[:-1]) / 2)]
    (directory / "energy.dat").write_text(
        'TITLE = "fabricated"\nVARIABLES = "time [s]" "kinetic [J]" "external_work [J]" "balance_error '
        '[1]"\nZONE T="history"\n'
        + "".join(f"{t:.16e} {kinetic * w:.16e} {w:.16e} 0\n" for t, w in zip(time, work))
    )
    if snapshots:
        at = peak if snapshot_at is None else snapshot_at
        index = directory / "particles.xdmf"
        for step, (i, unloaded) in enumerate(((0, False), (at, False), (depth.size - 1, True))):
            if i < peak or not unloaded or force[-1] <= 0:
                particle_file(
                    directory / f"particles_{step:08d}.hdf",
                    time[i],
                    depth[i] if not unloaded else deepest,
                    unloaded,
                    share,
                    fine,
                    rise,
                )
                with index.open("a") as file:
                    file.write(f"<DataItem>particles_{step:08d}.hdf:/VTKHDF/Points</DataItem>\n")
    return directory


def run(name, *options, plots=False):
    """Status, what it printed, the JSON (None without)."""
    directory, out = WORK / name, io.StringIO()
    sys.argv = ["hardness.py", *options, *([] if plots else ["--no-plots"]), str(directory)]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        try:
            status = hardness.main()
        except SystemExit as error:  # of the arguments
            status = error.code
    files = (
        sorted(directory.glob("hardness*.json"), key=lambda path: path.stat().st_mtime)
        if directory.is_dir()
        else []
    )
    return status, out.getvalue(), json.loads(files[-1].read_text()) if files and status == 0 else None


# ---- what is known comes back ----

for name, share, options in (
    ("quarter", 0.25, {}),
    ("half", 0.5, {"gap": 50e-9}),
    ("whole", 1.0, {}),
    ("levels", 0.25, {"fine": True}),
):
    fabricate(name, share, **options)
    status, text, answer = run(name, plots=name in ("quarter", "levels"))
    require(f"{name}: exit status 0", status == 0)
    if answer is None:
        print(text)
        continue
    for key, value in exact.items():
        tolerance = 1e-3 if key not in ("pile_up", "area_true") else 5e-3 if key == "area_true" else 0.15
        require(f"{name}: {key} {answer[key]:.6g}, exact {value:.6g}", near(answer[key], value, tolerance))
        require(f"{name}: {key} has an uncertainty", isinstance(answer.get(f"{key}_uncertainty"), float))
    require(
        f"{name}: the profile's area within its uncertainty",
        abs(answer["area_profile"] - true) < answer["area_profile_uncertainty"],
    )
    require(
        f"{name}: pile-up within its uncertainty",
        abs(answer["pile_up"] - 0.1 * deepest) < answer["pile_up_uncertainty"],
    )
    require(f"{name}: nothing is missing", answer["missing"] == [] and answer["notes"] == [])
    require(f"{name}: the share of the model", answer["model_share"] == share)
    require(f"{name}: no partial file", not list((WORK / name).glob(".*.part")))
    for picture in ("load_depth", "profile", "pressure") if name in ("quarter", "levels") else ():
        data = (WORK / name / f"hardness_{picture}.png").read_bytes()
        require(f"{name}: hardness_{picture}.png", data[:8] == b"\x89PNG\r\n\x1a\n" and len(data) > 10000)
rows = list(csv.reader((WORK / "half/hardness.csv").open()))
require(
    "hardness.csv: columns, nm and mN, from the surface, of the full body",
    rows[0] == ["time [s]", "depth [nm]", "load [mN]"]
    and near(float(rows[400][1]), 200, 1e-9)
    and near(float(rows[400][2]), 2, 1e-9)
    and len(rows) == 600,
)
for source in ("half", "half/tool_cone.dat"):  # as make identify reads it
    measured = read_curve(WORK / source)
    require(
        f"{source}: the curve of the whole from the touch on",
        near(measured.depth.max(), deepest, 1e-9) and near(measured.load.max(), load, 1e-9),
    )
rings = np.loadtxt(WORK / "quarter/hardness_profile.csv", delimiter=",", skiprows=1)
loaded = rings[rings[:, 0] == 0]
require(
    "hardness_profile.csv: far out the wedge's height",
    all(abs(row[2] - 1e9 * heights(row[1] * 1e-9, deepest, False)) < 1 for row in loaded if row[1] > 700),
)
require(
    "hardness_profile.csv: the pressure within the contact",
    near(np.mean(loaded[loaded[:, 1] < 500, 5]), 1e-9 * load / true, 1e-6),
)

# ---- options ----

_, text, answer = run("quarter", "--beta", "1.2", "--epsilon", "0.75", "--window", "40,95")
require(
    "beta, epsilon, window as said",
    answer["beta"] == 1.2
    and answer["epsilon"] == 0.75
    and answer["window"] == [0.4, 0.95]
    and near(answer["modulus_true"], exact["modulus_true"] * beta / 1.2, 1e-3)
    and near(answer["contact_depth"], deepest - 0.75 * load / stiffness, 1e-4),
)
require("the window is printed", "fit over 40 to 95 % of the load" in text)
_, _, answer = run("quarter", "--area-coefficients", "24.5,0,0,0")
require("an area function of coefficients", near(answer["area_oliver_pharr"], 24.5 * edge**2, 1e-3))
_, _, answer = run("quarter", "--area", "profile")
require(
    "the area of the profile",
    answer["area_true"] == answer["area_profile"]
    and near(answer["hardness_true"], load / answer["area_profile"], 1e-6),
)
fabricate("small", area_share=0.8)
_, text, answer = run("small")
require(
    "areas that are far apart: that of the history, and a note",
    answer["area_true_source"] == "column"
    and answer["area_true"] == answer["area_history"]
    and near(answer["area_history"], 0.8 * true, 1e-3)
    and "-20 % from the area in which the surface touches the tool" in text,
)
fabricate("without", area_share=0.0)
_, text, answer = run("without")
require(
    "the profile's where the history has none",
    answer["area_true_source"] == "profile" and answer["area_true"] == answer["area_profile"],
)
_, _, answer = run("small", "--area", "profile")
last = answer["unloadings"][-1]
require(
    "--area profile: the row over depth has that area too",
    last["area_true"] == answer["area_profile"]
    and all(last[key] == answer[key] for key in ("hardness_true", "modulus_true", "young_true")),
)
for name, low, high in (
    ("clamp", (1e-6, -2e-6, 0), (2e-6, 2e-6, top + 8e-7)),
    ("above", (-1e-6, -1e-6, top + 1e-6), (1e-6, 1e-6, top + 2e-6)),
):
    fabricate(
        name,
        1.0,
        beside="&material name='steel', model='elastic', density=7800, young=210e9, poisson=0.3 /\n"
        f"&body material='steel', shape='box', lower={','.join(map(str, low))}, "
        f"upper={','.join(map(str, high))} /\n",
    )
    _, _, answer = run(name)
    require(
        f"another body, {name}: the tool is pressed into the one below its tip",
        near(answer["max_depth"], deepest, 1e-9) and near(answer["young_scene"], young, 1e-9),
    )
pit = fabricate("pit", gap=300e-9)
hollow = f"&cut body='body1', shape='box', lower=0,0,{top}, upper=1e-6,1e-6,{top} /\n"
case = (pit / "case.nml").read_text().replace("&body material", "&body name='body1', material") + hollow
(pit / "case.nml").write_text(case)
status, text, _ = run("pit")
require("a cut, by an older version: refused", status == 2 and "run the scene again" in text, text)
history = (pit / "tool_cone.dat").read_text()
said = history.replace("AUXDATA", 'AUXDATA indented_body="1"\nAUXDATA surface_gap="3e-7"\nAUXDATA', 1)
(pit / "tool_cone.dat").write_text(said)
_, _, answer = run("pit")
require("a cut: the depth from the surface that the run found", near(answer["max_depth"], deepest, 1e-9))
for wrong in (("--window", "98,20"), ("--beta", "0"), ("--epsilon", "x"), ("--area", "other")):
    require(f"{' '.join(wrong)} is refused", run("quarter", *wrong)[0] == 2)
for shape, name in (
    ("shape='berkovich', half_angle=65.27, edge=1,0,0,", "Berkovich"),
    ("shape='sphere', radius=3e-6,", "sphere"),
):
    fabricate(name, shape=shape)
    status, _, answer = run(name)
    area = (
        3 * math.sqrt(3) * math.tan(math.radians(65.27)) ** 2 * edge**2
        if name == "Berkovich"
        else math.pi * edge * (6e-6 - edge)
    )
    require(
        f"{name}: its area function and beta",
        status == 0
        and near(answer["area_oliver_pharr"], area, 1e-3)
        and answer["beta"] == (1.034 if name == "Berkovich" else 1.0),
    )
fabricate("wedge", shape="shape='wedge', half_angle=70.3, edge=1,0,0,")
status, text, answer = run("wedge")
require(
    "wedge: no area function, and says so",
    status == 0
    and "No area function" in text
    and answer["hardness_oliver_pharr"] is None
    and near(answer["stiffness"], stiffness, 1e-4)
    and near(answer["hardness_true"], load / true, 5e-3),
)

# ---- without unloading ----

into = inward(400)
for name, more, mean in (
    ("held", 0.97 + 0.02 * np.cos(np.arange(200)), 0.97),  # the load has fallen, and swings
    ("not held", [], 1.0),
):
    more = np.array(more)
    fabricate(name, curve=(np.r_[into[0], into[0][-1] + 0 * more], np.r_[into[1], into[1][-1] * more]))
    _, text, answer = run(name)
    require(
        f"{name}, no unloading: the load {answer['max_load'] / into[1][-1]:.4f} of the end's",
        near(answer["max_load"], mean * into[1][-1], 1e-3)
        and answer["max_load_uncertainty"] < 0.003 * answer["max_load"]
        and "no unloading of more than" in text,
    )
fabricate("few rows", curve=inward(6))
_, _, answer = run("few rows")
require("few rows: the load's uncertainty is not known", answer["max_load_uncertainty"] is None)

# ---- partial unloads ----

fabricate("partial", curve=partial_unloads())
status, text, answer = run("partial", plots=True)
require("partial unloads: three of them", status == 0 and len(answer["unloadings"]) == 3)
for row, size in zip(answer["unloadings"], (0.4, 0.7, 1.0)):
    require(
        f"partial unloads: H and E at {1e9 * row['max_depth']:.0f} nm",
        near(row["hardness_oliver_pharr"], exact["hardness_oliver_pharr"], 2e-3)
        and near(row["modulus_oliver_pharr"], exact["modulus_oliver_pharr"], 2e-3)
        and near(row["max_load"], size**2 * load, 1e-3),
    )
require(
    "partial unloads: files over depth",
    (WORK / "partial/hardness_depth.png").is_file()
    and len(list(csv.reader((WORK / "partial/hardness_depth.csv").open()))) == 4,
)
require(
    "partial unloads: the rest of the last is the fit's, and says so",
    near(answer["work_elastic"], back, 0.01) and "ends before the load is 0" in text,
)

# ---- what is missing is said ----

fabricate("loading", curve=inward(400))
status, text, answer = run("loading")
require(
    "no unloading: a sentence, and what can be had",
    status == 0
    and "no unloading of more than" in text
    and answer["stiffness"] is None
    and answer["modulus_true"] is None
    and near(answer["hardness_true"], load / true, 5e-3)
    and near(answer["loading_curvature"], load / deepest**2, 1e-6)
    and near(answer["pile_up"], 0.1 * deepest, 0.15),
)
(h, p), (hb, pb) = inward(400), outward(9)
fabricate("few", curve=(np.r_[h, hb], np.r_[p, pb]))
status, text, answer = run("few")
require(
    "too few rows: a sentence",
    status == 0 and "rows between 20 and 98 % of its load" in text and answer["stiffness"] is None,
)
fabricate("unseen", snapshots=False)
status, text, answer = run("unseen")
require(
    "no snapshots: a sentence",
    status == 0
    and "wrote no particle files" in text
    and answer["pile_up"] is None
    and answer["stiffness"] is not None,
)

# the edge of a contact of which a ring near the axis hovers: particles under a tip do, where they are as
# large as it is blunt
width = 60e-9
x, y = (a.ravel() for a in np.meshgrid(*[np.arange(-2.01e-6, 2.04e-6, width)] * 2))
r = np.hypot(x, y)
hover = np.where((r > 2.2 * width) & (r < 4.4 * width), 0.3 * width, 0.0)
surface = imprint.Surface(
    np.c_[x, y], heights(r, deepest, False) - hover, np.full(x.size, width / 2), 0 * x, 0 * x, 2 * width
)
found = imprint.contact_radius(surface, {"shape": ["cone"], "half_angle": [70.3]}, -deepest)
require(
    f"a ring that hovers is not the edge of the contact: {1e9 * found[0]:.0f} nm",
    abs(found[0] - radius) < 0.5 * width,
)

fabricate("late", snapshot_at=200)
status, text, answer = run("late")
require(
    "no snapshot at the largest depth: a sentence",
    status == 0 and "the snapshot nearest to the largest depth is at" in text and answer["pile_up"] is None,
)
fabricate(
    "springs_back",
    curve=(np.r_[inward(400)[0], inward(400)[0][::-1][1:]], np.r_[inward(400)[1], inward(400)[1][::-1][1:]]),
)
rows = (WORK / "springs_back/energy.dat").read_text().splitlines()
most = max(float(row.split()[2]) for row in rows[3:])
(WORK / "springs_back/energy.dat").write_text(
    "\n".join(
        rows[:3] + [" ".join([row.split()[0], f"{0.001 * most:.16e}", *row.split()[2:]]) for row in rows[3:]]
    )
    + "\n"
)
status, text, answer = run("springs_back")
require(
    "kinetic energy is compared with the largest work, not with what an elastic unloading has left of it",
    status == 0 and "not quasi-static" not in text and near(answer["kinetic_share"], 0.008, 0.02),
)

fabricate("fast", kinetic=0.05)
status, text, answer = run("fast")
require(
    "kinetic energy above 1 %: a sentence",
    status == 0 and "not quasi-static" in text and near(answer["kinetic_share"], 0.05, 1e-6),
)
require(
    "kinetic energy of a third of what comes back: stiffness and moduli are not measured; what to do",
    answer["stiffness"] is None
    and answer["young_true"] is None
    and "young_true" in answer["not_measured"]
    and text.count("  not measured: ") == 1
    and re.search(r"E, true +not measured\n", text) is not None
    and "kinetic energy at the start of the unloading is 32 % of" in text
    and "the tool is slow enough: use flip_fraction" in text,
)
require(
    "but the load and the true area are", answer["max_load"] is not None and answer["area_true"] is not None
)
case = (WORK / "fast/case.nml").read_text()
(WORK / "fast/case.nml").write_text(case + "&quasi_static step=1e-12 /\n")
_, still, quasi_static = run("fast")
require(
    "quasi-static steps have no inertia",
    quasi_static["stiffness"] is not None and quasi_static["parts"]["stiffness"]["inertia"] == 0,
)
(WORK / "fast/case.nml").write_text(case)
too_fast = systematic.Motion(speed_in=20, enough_in=2.57, speed_back=1, enough_back=0.5, noise=0.4, stop=0.4)
require(
    f"a tool that is too fast: {too_fast.cure()}",
    too_fast.cure() == "use speed <= 2.5 m/s for the loading and 0.5 m/s for the unloading"
    and {"stiffness", "hardness_true", "young_true"} < set(systematic.not_measured(too_fast)),
)
none = systematic.Motion()
shares = [
    systematic.parts_of(none, 4.0, 0.0, None, None, {}, section)["stiffness"]["cells"]
    for section in (False, True)
]
require(
    f"the edge of a section's contact is a ring, off by a cell's uniform distribution: {shares}",
    near(math.sqrt(shares[1] ** 2 - shares[0] ** 2), 1 / math.sqrt(12) / 4.0, 1e-9),
)
returned = 1 - answer["work_ratio"]
require(
    "and beside what unloading gives back: another",
    "recovered in unloading" in text and near(answer["kinetic_over_returned"], 0.05 / returned, 1e-6),
)
_, text, answer = run("quarter")
parts = answer["parts"]
require(
    "the parts of an uncertainty make it up",
    all(
        near(math.hypot(*causes.values()), answer[f"{key}_uncertainty"], 1e-9)
        for key, causes in parts.items()
    )
    and {"curve", "inertia", "cells", "base"} == set(parts["stiffness"])
    and "energy" in parts["work_ratio"],
)
require(
    f"a rigid base adds q S/(E't) to the stiffness: {parts['stiffness']['base'] / stiffness:.4f}",
    near(parts["stiffness"]["base"] / stiffness, 0.4384 * stiffness * (1 - poisson**2) / young / top, 2e-3),
)
require(
    "where it is small beside that: none",
    0 < answer["kinetic_over_returned"] < 0.1 and "recovered in unloading" not in text,
)

# laws that creep or relax: no modulus from an unloading without a hold, from one whose load still falls in
# the hold, or where the law relaxes during it; else the rates are a part of the uncertainty
(h, p), (hb, pb) = inward(400), outward(200)
for name, fall, times, measured in (
    ("no_hold", None, 1e-4, False), ("falls", 0.3, 1e-4, False), ("relaxes", 0.0, 3e-7, False),
    ("still", 0.0, 1e-4, True),
):  # fmt: skip
    held = np.zeros(0) if fall is None else np.linspace(0, fall, 60)
    last = 1 - (held[-1] if held.size else 0.0)
    curve = np.r_[h, h[-1] + 0 * held, hb], np.r_[p, p[-1] * (1 - held), last * pb]
    directory = fabricate(name, curve=curve)
    case = (directory / "case.nml").read_text()
    words = f"model='maxwell', relaxation_times={times}, shear_ratios=0.5, bulk_ratios=0.5,"
    relaxing = case.replace("model='j2',", words).replace(", yield_stress=7e8", "")
    (directory / "case.nml").write_text(relaxing)
    status, text, answer = run(name)
    require(
        f"maxwell, {name}: stiffness and moduli are {'' if measured else 'not '}measured, status {status}",
        status == 0
        and all((answer[key] is not None) == measured for key in ("stiffness", "young_true", "modulus_true"))
        and ("the law flows" in text) != measured
        and answer["hardness_true"] is not None
        and re.search(r"E of the scene .* instantaneous", text) is not None,
        text,
    )
    if measured:
        require(
            f"maxwell, {name}: what relaxes is in the bar",
            0 < answer["parts"]["stiffness"]["flow"] < 0.01 * stiffness,
        )
    (directory / "case.nml").write_text(case)
    _, text, answer = run(name)
    require(
        f"{name}: the same curve of a law that does not flow",
        "the law flows" not in text and "flow" not in (answer["parts"].get("stiffness") or {}),
    )

# few rows: a hold of seven rows whose load falls by 30 %, and none; a way back too short for a fit
steps = deepest * np.linspace(0, 1, 15)
few = {
    "short_hold": (
        np.r_[steps, [deepest] * 6],
        np.r_[load * (steps / deepest) ** 2, load * np.array([0.8, 0.72, 0.7, 0.7, 0.7, 0.7])],
    ),
    "few_rows": (steps, load * (steps / deepest) ** 2),
}
for name, curve in few.items():
    fabricate(name, curve=tuple(np.r_[c, b[:3]] for c, b in zip(curve, outward(200), strict=True)))
status, text, answer = run("short_hold")
require(
    "a load that falls in a hold of seven rows: it is the mean there, and H is not measured",
    status == 0
    and near(answer["max_load"], 0.7 * load, 1e-6)
    and answer["hardness_true"] is None
    and "the load falls by 30 % when the tool stops" in text,
)
status, text, answer = run("few_rows")
require(
    "a load whose scatter is not known: H is not measured, with what to do",
    status == 0
    and answer["hardness_true"] is None
    and near(answer["untrusted"]["hardness_true"][0], load / true, 1e-3)
    and "write more rows (history_every of &output), or use a longer hold" in text,
)

fabricate("two", tools=("cone", "other"))
status, text, _ = run("two")
require(
    "two tools: which is asked", status == 2 and "TOOL=cone or TOOL=other" in text and text.count("\n") == 1
)
status, text, answer = run("two", "--tool", "other")
require(
    "two tools: the one said",
    status == 0 and answer["tool"] == "other" and (WORK / "two/hardness_other.csv").is_file(),
)
require("a tool that is not there", run("two", "--tool", "third")[0] == 2)
fabricate("air", curve=(np.linspace(0, 1e-7, 50) - 2e-7, np.zeros(50)))
status, text, _ = run("air")
require(
    "never touches: a sentence, status 2",
    status == 2 and "never in contact" in text and text.count("\n") == 1,
)
broken = fabricate("broken")
history = broken / "tool_cone.dat"
history.write_text(history.read_text().replace(history.read_text().splitlines()[100].split()[4], "NaN"))
status, text, _ = run("broken")
require("not a number in the history: status 2", status == 2 and "not finite" in text)
fabricate("shareless", model_share=False)
status, text, _ = run("shareless")
require("no model_share: status 2", status == 2 and "model_share" in text)
fabricate("toolless", tools=())
require("no tool: status 2", run("toolless")[0] == 2 and "has no tool" in run("toolless")[1])
(WORK / "empty").mkdir()
require(
    "an empty directory: status 2", run("empty")[0] == 2 and "not the directory of a run" in run("empty")[1]
)
require("no directory: status 2", run("nowhere")[0] == 2)

# files that are not what they should be: a sentence and status 2, whatever they hold
rng = np.random.default_rng(60)
noise = bytes(rng.integers(0, 256, 3000, dtype=np.uint8))
for name in ("case.nml", "tool_cone.dat", "energy.dat"):
    directory = fabricate(f"spoilt_{name.split('.')[0]}")
    whole = (directory / name).read_bytes()
    spoilt = {
        "binary": noise,
        "empty": b"",
        "half": whole[: len(whole) // 2],
        "not a number": re.sub(rb"(?<=[ =])[0-9][0-9.]*([eE][-+]?[0-9]+)?", b"NaN", whole, count=9),
        "words": re.sub(rb"(?<==)[0-9.e+-]+", b"'words'", whole)
        if name == "case.nml"
        else re.sub(rb"(?<=[0-9])[eE](?=[-+])", b"words", whole, count=9),
    }
    for kind, content in spoilt.items():
        (directory / name).write_bytes(content)
        try:
            status, text, _ = run(directory.name, "--no-plots")
        except Exception as error:
            status, text = 1, f"Traceback: {error}"
        sentence = text.strip()
        require(
            f"{name}, {kind}: status {status}, {sentence[-100:]}",
            status == 0 and "nan" not in text.lower() or status == 2 and 0 < len(sentence.splitlines()) == 1,
        )
for command in (["study"], ["solve", "--error", "1"]):
    (WORK / "spoilt.nml").write_bytes(noise)
    done = subprocess.run(
        [sys.executable, "-m", "gimp3d", *command, WORK / "spoilt.nml"],
        capture_output=True,
        text=True,
        cwd=WORK,
    )
    sentence = done.stderr.strip()
    require(
        f"{command[0]}, binary: status {done.returncode}, {sentence[-100:]}",
        done.returncode == 2 and "Traceback" not in sentence and sentence.count("\n") == 0,
    )
finish()
