"""The parts of post/gimp3d/study.py with made-up numbers. usage: units.py ROOT"""

import itertools
import random
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

ROOT = Path(sys.argv[1])
from gimp3d import study_fit as fit
from gimp3d.study import Comparison, Study
from gimp3d import study_quantity as quantities
from gimp3d import study_setting
from gimp3d.run_data import Unreadable, read_namelists
from gimp3d.scene_text import BadSetting, Scene
from gimp3d.study_body import box_around, size_of
from gimp3d.study_scene import add_probes, is_about_point, scene_of
from checks import finish, near, require


def refused(kind, word, action):
    """Whether an action is refused with a sentence that has this word."""
    try:
        action()
    except kind as error:
        return word in str(error)
    return False


# ---- fitting ----

sizes = [4.0, 2.0, 1.0, 0.5]
require("order of 3 h^1.7", near(fit.fitted_order(sizes, [3 * h**1.7 for h in sizes]), 1.7))
require("order of errors that grow is negative", fit.fitted_order(sizes, [1 / h for h in sizes]) < 0)
require("no order from one size", fit.fitted_order([1.0], [2.0]) is None)
require(
    "norms of a known difference",
    np.allclose(fit.norms([1.0, 2.0, -3.9], np.array([1.0, 2.0, -4.0])), [2.5 / 3**0.5, 2.5]),
)

x = np.linspace(0, 1, 11)
curves = [np.sin(x) + (0.1 + x) * h**1.5 for h in (4.0, 3.0, 1.0)]
limit, order = fit.richardson([4.0, 3.0, 1.0], curves)
beside = object.__new__(Comparison)  # where the finest run is the reference, because grids show no order
beside.quantity, beside.limit, beside.finest = SimpleNamespace(kind="load"), x, 1.0
finest, other, coarse = (type("run", (), {"cell": cell}) for cell in (1.0, 1.0, 2.0))
beside.unknown, beside.y = finest, {other: x + 1e-4, coarse: x + 0.1}
require(
    "another run on the reference's cells has no known error, a coarser one has",
    beside.error(other) == (None, None) and beside.error(coarse)[0] > 1,
)
require("Richardson: the limit of f + c h^1.5 on uneven sizes", np.allclose(limit, np.sin(x), atol=1e-9))
require("Richardson: its order", near(order, 1.5, 1e-6))
shuffled, _ = fit.richardson([1.0, 4.0, 3.0], [curves[2], curves[0], curves[1]])
require("Richardson: the order of the sizes does not matter", np.allclose(shuffled, limit))
require(
    "Richardson: refuses curves that go to and fro",
    refused(fit.NoOrder, "would be", lambda: fit.richardson([4.0, 2.0, 1.0], [x, x + 1, x])),
)
require(
    "Richardson: refuses curves that run away",
    refused(fit.NoOrder, "would be", lambda: fit.richardson([4.0, 2.0, 1.0], [x, x + 1, x + 3])),
)
require(
    "Richardson: refuses two", refused(fit.NoOrder, "three grids", lambda: fit.richardson([2.0, 1.0], [x, x]))
)
require(
    "Richardson: refuses the same bits",
    refused(fit.NoOrder, "same bits", lambda: fit.richardson([4.0, 2.0, 1.0], [x + 1, x, x])),
)
require(
    "halving, from a step to a half, a quarter and the double at first order, to the double at second",
    np.allclose([fit.halved(1.0, 1.0, other, 3.0) for other in (0.5, 0.25, 2.0)], [3.0, 2.0, 1.5])
    and near(fit.halved(2.0, 1.0, 2.0, 4.0), 1.0),
)

# ---- Pareto ----

chance = random.Random(7)
for size in (1, 2, 30):
    costs, errors = ([chance.choice([1, 2, 3, 5, 8, 13]) for _ in range(size)] for _ in range(2))
    beaten = {
        i
        for i, j in itertools.permutations(range(size), 2)
        if costs[j] <= costs[i] and errors[j] <= errors[i] and (costs[j], errors[j]) != (costs[i], errors[i])
    }
    front = fit.pareto(costs, errors)
    require(
        f"Pareto front of {size} points, by trying all",
        {(costs[i], errors[i]) for i in front}
        == {(costs[i], errors[i]) for i in range(size) if i not in beaten},
    )
front = fit.Front([1.0, 4.0, 2.0, 3.0, float("nan")], [8.0, 0.5, 2.0, 7.0, 0.1])
require(
    "front: drops what is beaten and what is no number",
    list(front.costs) == [1, 2, 4] and list(front.errors) == [8, 2, 0.5],
)
require(
    "front: between two points in logarithms",
    near(front.cost_of(4.0)[0], 2**0.5) and front.cost_of(4.0)[1] == "",
)
require("front: a point itself", near(front.error_for(2.0)[0], 2.0) and front.error_for(2.0)[1] == "")
require(
    "front: beyond the best run it says so",
    near(front.cost_of(0.125)[0], 8.0) and front.cost_of(0.125)[1] == "extrapolated",
)
require(
    "front: not beyond ten times the cost",
    front.error_for(41.0)[0] is None and front.cost_of(1e-4)[0] is None,
)
require(
    "front: nothing is cheaper than the cheapest",
    front.error_for(0.5)[0] is None and front.cost_of(9.0)[0] is None,
)
require(
    "front: one run is not extrapolated", fit.Front([1.0], [1.0]).error_for(2.0) == (None, "one run alone")
)
double = fit.Front(2 * front.costs, front.errors)
mean, least, most, span = fit.ratio_at_equal_error(double, front)
require(
    "ratio at equal error: twice as dear is 2",
    near(mean, 2) and near(least, 2) and near(most, 2) and np.allclose(span, (0.5, 8)),
)
alone = fit.Front([3.0], [2.0])
require(
    "ratio at equal error: of one run alone, both ways",
    near(fit.ratio_at_equal_error(alone, front)[0], 1.5)
    and near(fit.ratio_at_equal_error(front, alone)[0], 1 / 1.5)
    and fit.ratio_at_equal_error(alone, alone) is None,
)
require(
    "ratio at equal error: of one run a little beyond, not far beyond",
    near(fit.ratio_at_equal_error(fit.Front([3.0], [0.46]), front)[0], 3 / front.cost_of(0.46)[0])
    and fit.ratio_at_equal_error(fit.Front([3.0], [0.4]), front) is None,
)
require(
    "ratio at equal error: none without a common error",
    fit.ratio_at_equal_error(fit.Front([1, 2], [100, 50]), front) is None,
)

# ---- scenes ----

text = """! &grid in a comment, cell_size=3
&scene title='a / b, cell_size=9', end_time=2e-3 / ! ends
&grid lower=0,0,0, upper=2,2,3, ! comment / here
   cell_size=0.5, boundary=6*'free' /
&level lower=0,0,1, upper=1,1,3 /
&tool name='one', times=0,1, speeds=0,2, tip=0,0,2 /
&tool name='two', times=0,4, speeds=1,1, tip=0,0,2 /
&anti_locking /
&body particles_per_cell=8 /
"""
setting = study_setting.Setting("", {}, [], {}, {}, [], [], [], 5.0, [[[-1, 0, 2], [0.5, 0.5, 9]]])


def turned(**settings):
    return read_namelists(scene_of(text, settings, setting).text)


require("editing: nothing turned, nothing changed", scene_of(text, {}, setting).text == text)
case = turned(cell=0.75)
grid = case["grid"][0]
require(
    "editing: cells and whole cells above",
    grid["cell_size"] == [0.75]
    and grid["upper"] == [2.25, 2.25, 3.0]
    and grid["boundary"] == ["free"] * 6
    and case["scene"][0]["title"] == ["a / b, cell_size=9"],
)
require(
    "editing: a level's side on the grid's stays there",
    turned(cell=0.7)["level"][0]["upper"] == [1.0, 1.0, 3.5],
)
require(
    "editing: levels taken out and added, cut at the grid",
    "level" not in turned(levels=0)
    and turned(levels=2)["level"][1] == {"lower": [0, 0, 2], "upper": [0.5, 0.5, 3]},
)
require("editing: a third level is refused", refused(BadSetting, "levels=3", lambda: turned(levels=3)))
case = turned(speed=2.0)
require(
    "editing: twice the speed in half the time",
    case["scene"][0]["end_time"] == [1e-3]
    and case["tool"][0]["speeds"] == [0, 4]
    and case["tool"][1]["times"] == [0, 2]
    and case["tool"][0]["times"] == [0, 0.5],
)
require("editing: a group that is not there is made", turned(safety=0.1)["time"] == [{"safety": [0.1]}])
require(
    "editing: a variable more in an empty group",
    turned(**{"anti_locking.kind": "it's"})["anti_locking"] == [{"kind": ["it's"]}],
)
case = turned(**{"tool(2).tip": [1.0, 2.0, 3e-7]})
require(
    "editing: the second of a kind only",
    case["tool"][1]["tip"] == [1, 2, 3e-7] and case["tool"][0]["tip"] == [0, 0, 2],
)
require(
    "editing: a third that is not there is refused",
    refused(BadSetting, "number 3", lambda: turned(**{"tool(3).tip": 0})),
)
require("editing: an unknown knob is refused", refused(BadSetting, "unknown knob", lambda: turned(cells=1)))
case = turned(scheme="quasi_static", steps=8)
require(
    "editing: so many quasi-static steps",
    case["quasi_static"] == [{"step": [0.25e-3], "max_step": [0.25e-3]}]
    and "quasi_static" not in turned(**{"quasi_static.step": 1e-3, "scheme": "explicit"}),
)
require("editing: an unknown scheme is refused", refused(BadSetting, "allowed", lambda: turned(scheme="x")))
require("editing: without a group", "anti_locking" not in turned(without="anti_locking"))
scene = Scene(text)
add_probes(scene, (0.0, 1.0, 2.0))
places = np.array([one["position"] for one in read_namelists(scene.text)["probe"]])
require(
    "editing: eight probes about a node, within the level's smaller particles",
    len(places) == 8
    and np.allclose(places.mean(axis=0), [0.0625, 1, 2])
    and np.allclose(np.ptp(places, axis=0), [0, 0.125, 0.125]),
)
for geometry in ("axisymmetric", "plane_strain"):
    scene = Scene(
        f"&grid geometry='{geometry}', lower=0,0, upper=2,3, cell_size=0.5, boundary=4*'free' /\n"
        "&body particles_per_cell=8 /\n&probe name='own', position=1,0,1 /\n"
    )
    add_probes(scene, (1.0, 0.0, 2.0))
    own, *about = read_namelists(scene.text)["probe"]
    places = np.array([one["position"] for one in about])
    require(
        f"editing: {geometry}: four probes about a node, in the section; the scene's own stays",
        own["name"] == ["own"]
        and not is_about_point(own)
        and all(map(is_about_point, about))
        and places.shape == (4, 3)
        and np.all(places[:, 1] == 0)
        and np.allclose(places.mean(axis=0), [1, 0, 2])
        and np.allclose(np.ptp(places, axis=0), [0.25, 0, 0.25]),
    )
    require(
        f"editing: {geometry}: a point beside the section is refused",
        refused(BadSetting, "y must be 0", lambda: add_probes(scene, (1.0, 0.1, 2.0))),
    )
require(
    "editing: a group that does not end is refused",
    refused(Unreadable, "does not end", lambda: read_namelists("&a b=1\n")),
)

# ---- curves and settings ----

time = np.linspace(0, 1, 2001)
swing = 3 - np.cos(2 * np.pi * 4.4 * time)
require("frequency of a vibration about its mean", near(quantities.frequency(time, swing, None), 4.4, 1e-3))
load = study_setting.Quantity("load", "load")
noisy = (time, 5 * time + 0.1 * (-1) ** np.arange(2001))
require(
    "loads: lines are fitted through noise",
    np.allclose(quantities.at(load, noisy, np.array([0.5, 0.9, 1.0])), [2.5, 4.5, 5], atol=1e-2),
)


way = np.r_[np.linspace(0, 1, 101), np.linspace(1, 0.8, 21)[1:]]  # m, in and back
rows = "".join(f"{t} {d} 0 0 {5 * d if t < 101 else 0}\n" for t, d in enumerate(way))
Path("tool_tip.dat").write_text(
    'TITLE="t"\nVARIABLES="time [s]", "depth [m]", "load_x [N]", "load_y [N]", "load_z [N]"\nZONE T="t"\n'
    'AUXDATA model_share="1"\n' + rows
)
run = SimpleNamespace(
    directory=Path("."),
    settings={},
    case=read_namelists(
        "&body shape='box', lower=0,0,0, upper=1,1,1 /\n&tool name='tip', shape='cone', tip=0,0,1 /\n"
    ),
)
there, force = quantities.curve_of(run, load)
require(
    "loads: the way back is not among them",
    len(there) == 101 and there[-1] == 1 and np.allclose(force, 5 * there),
)


# ---- values at a point ----


def around(point, cell, low=(0, 0, 0), boundary="free"):
    """A run with cells of a size, of which the eight particles about a point are nearest to it."""
    case = read_namelists(
        f"&grid lower={','.join(map(str, low))}, upper=9,9,9, cell_size={cell}, boundary=6*'{boundary}' /\n"
    )
    return SimpleNamespace(case=case, cell=cell), study_setting.Quantity(
        "p", "probe", point=point, column="a"
    )


def value(place):
    return 7 + 2 * place[..., 0] - 3 * place[..., 1] + 5 * place[..., 2]


corners = np.array(list(itertools.product((-0.25, 0.25), repeat=3)))
for name, shift, same in (("evenly", (0, 0, 0), True), ("aside", (0.1, -0.05, 0.2), False)):
    point = np.array([2.0, 3.0, 4.0])
    run, quantity = around(tuple(point), 1.0)
    places = point + corners + shift
    weights = quantities.weights_at(run, quantity, places)
    require(
        f"point: particles {name} about it: a linear field has its value there",
        near(weights @ value(places), value(point)) and near(weights.sum(), 1.0),
    )
    require(
        f"point: and their mean {'has it too' if same else 'has not'}",
        near(value(places).mean(), value(point)) == same,
    )
run, quantity = around((0.0, 3.0, 4.0), 1.0, boundary="symmetry")
places = np.array([0.25, 3.0, 4.1]) + corners * (0, 1, 1)
weights = quantities.weights_at(run, quantity, places)
require(
    "point: on a side of symmetry the row next to it stands for it",
    near(weights @ value(places + (-0.25, 0, 0)), value(np.array([0, 3, 4]))),
)
run, quantity = around((2.0, 3.0, 4.0), 1.0)
require(
    "point: particles on one side of it are refused",
    refused(
        BadSetting,
        "one side of it along z",
        lambda: quantities.weights_at(run, quantity, np.array([2, 3, 4.3]) + corners),
    ),
)
flat = read_namelists("&grid geometry='plane_strain', lower=0,0,0, upper=9,1,9, cell_size=1 /\n")
run, quantity = SimpleNamespace(case=flat, cell=1.0), quantity
quantity.point = (2.0, 0.0, 4.0)
places = np.array([2.1, 0.0, 4.2]) + corners[[0, 1, 4, 5]] * (1, 0, 1)
weights = quantities.weights_at(run, quantity, places)
require(
    "point: of the four particles of a section a linear field has its value there",
    near(weights @ value(places), value(np.array(quantity.point))),
)

# ---- a quantity that is 0 ----

Path("energy.dat").write_text(
    'TITLE="t"\nVARIABLES="time [s]", "gravity [J]", "balance_error [1]"\nZONE T="t"\n'
    + "".join(f"{t} 0 0\n" for t in range(5))
)
still = [
    type("run", (), {"directory": Path("."), "settings": {}, "share": 1.0, "good": True, "cell": cell})
    for cell in (1.0, 0.5, 0.25)
]
idle = study_setting.Quantity("idle", "energy", column="gravity")
study = SimpleNamespace(quantity=idle, setting_path=None, setting=SimpleNamespace(balance_limit=5.0))
plan = SimpleNamespace(
    all=lambda: [("a", run) for run in still], reference=None, families={"a": still}, main="a"
)
require(
    "a quantity that is 0 has no error in per cent, and a sentence says so",
    refused(BadSetting, "quantity idle: the finest run of a is 0", lambda: Comparison(study, plan)),
)

# ---- outputs ----

for group in ("output", "checkpoint"):
    Path("twice.nml").write_text(f"&{group} /\n&{group.upper()} /\n")
    require(
        f"a scene with two &{group} is refused, as by the program",
        refused(
            BadSetting,
            f"twice.nml: 2 groups &{group}; allowed: 0 or 1",
            lambda: Study(SimpleNamespace(scene=Path("twice.nml"))),
        ),
    )


def read(text):
    path = Path("setting.toml")
    path.write_text(text)
    return study_setting.read(path)


good = 'cells=[1.0]\n[quantity.load]\nkind="load"\n[families.a]\n'
require("setting: read", read(good)[0].families[0].rungs() == [{"cell": 1.0}])
for word, bad in (
    ("unknown cell", good.replace("cells", "cell")),
    ("kind='lod'", good.replace('"load"', '"lod"')),
    ("no values", good.replace("cells=[1.0]", "")),
    ("must be two", "comparisons=[['a','b']]\n" + good),
    ("needs a column", good.replace('"load"', '"probe"')),
    ("unknown colour", good.replace("kind=", "colour=1\nkind=")),
    ("must rise", good.replace("kind=", "window=[1,0.5]\nkind=")),
):
    require(f"setting: refused, {word}", refused(BadSetting, word, lambda: read(bad)))
require("setting: what is no TOML is refused", refused(Unreadable, "setting.toml", lambda: read("a = = 1")))
for path in sorted([*ROOT.glob("input/studies/**/*.toml"), *ROOT.glob("input/tutorial/studies/*.toml")]):
    read_setting, wanted = study_setting.read(path)
    name = path.stem.removesuffix("_placed")
    scene = next(place for folder in path.parents if (place := folder / f"{name}.nml").is_file())
    for family in read_setting.families:
        for rung in family.rungs():
            scene_of(scene.read_text(), {**read_setting.base, **rung}, read_setting)
    rungs = sum(len(family.values) for family in read_setting.families)
    require(f"setting: {path.name} and its scene make {rungs} rungs", bool(wanted))
for scene in sorted([*ROOT.glob("input/*.nml"), *ROOT.glob("input/tutorial/*.nml")]):
    given, wanted = study_setting.by_default(scene.read_text(), "")
    for family in given.families:
        for rung in family.rungs():
            scene_of(scene.read_text(), rung, given)
plain = SimpleNamespace(level_boxes=[])
for name in ("axisymmetric_hertz", "axisymmetric_taylor", "axisymmetric_indenter"):  # four values and six
    text = (ROOT / f"input/{name}.nml").read_text()
    cell = 0.5 * scene_of(text, {}, plain).values()["grid"][0]["cell_size"][0]
    new = scene_of(text, {"cell": cell}, plain).values()
    require(
        f"cell: the section of {name} stays one cell thick",
        new["grid"][0]["upper"][1] == cell
        and all(len(level["upper"]) == 3 for level in new.get("level", [])),
    )
shipped = {
    name: (ROOT / f"input/{name}.nml").read_text() for name in ("film", "hertz", "cone_levels", "billet")
}
for name in ("film", "hertz", "cone_levels"):
    old, new = (scene_of(shipped[name], body, plain).values() for body in ({}, {"body": 2.0}))
    require(
        f"body: {name} is twice as large, and its surface stays",
        abs(size_of(new) / size_of(old) - 2) < 0.1
        and old["tool"] == new["tool"]
        and box_around(old)[1][2] == box_around(new)[1][2],
    )
film, thick = (scene_of(shipped["film"], body, plain).values()["body"] for body in ({}, {"body": 2.0}))
require(
    "body: a film stays as thick, what it lies on does not",
    sorted(one["lower"][2] for one in film)[1] == sorted(one["lower"][2] for one in thick)[1]
    and min(one["lower"][2] for one in thick) < min(one["lower"][2] for one in film),
)
aside = (
    shipped["hertz"].replace("axis=0,0,-1", "axis=-1,0,0").replace("boundary='symmetry'", "boundary='free'")
)
wide = shipped["cone_levels"] + "&pressure lower=0,0,{top}, upper=1,1,{top}, times=0, values=1 /\n"
top = box_around(read_namelists(shipped["cone_levels"]))[1][2]
bore = """&grid geometry='axisymmetric', lower=0,0, upper=9,2, cell_size=1,
   boundary='symmetry','free','symmetry','symmetry' /
&body shape='box', lower=4,0,0, upper=8,1,2 /
&pressure lower=4,0,0, upper=4,1,2, times=0, values=1 /
"""
column = """&grid geometry='plane_strain', lower=0,0, upper=9,3, cell_size=1,
   boundary='symmetry','symmetry','roller','free' /
&body shape='box', lower=0,0,0, upper=9,1,2 /
&pressure lower=0,0,2, upper=9,1,2, times=0, values=1 /
"""
for word, text in (
    ("opposite the pressed", shipped["billet"]),
    ("pressed from the side", aside),
    ("has a &cut", shipped["hertz"] + "&cut body='b', shape='box' /\n"),
    ("has a &gravity", shipped["hertz"] + "&gravity acceleration=0,0,-9.81 /\n"),
    ("does not reach the side of symmetry x-", bore),
    ("no free side beside it", column),
    ("reaches beyond", wide.format(top=top)),
    ("under a wedge", shipped["hertz"].replace("'sphere', radius", "'wedge', radius")),
):
    require(f"body: refused, {word}", refused(BadSetting, word, lambda: scene_of(text, {"body": 2.0}, plain)))
finish()
