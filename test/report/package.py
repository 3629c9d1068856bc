"""The package gimp3d beside what a run wrote."""

import os
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import gimp3d
from gimp3d import History, Run, RunFailed, Scene, run, run_many
from gimp3d.scene_text import BadSetting
from checks import finish, require


scene = Scene("readers.nml")
require("a scene is read", scene["material"][0]["young"] == [70e9] and scene.directory == Path("read"))
scene.set("output", "formats", ["hdf5"])
scene.set("body", "particles_per_cell", np.int64(1))
scene.set("scene", "end_time", np.float64(scene["scene"][0]["end_time"][0]))
scene.set("body", "velocity", np.zeros(3))
scene.set("output", "fields", ["displacement", "deformation_gradient"])
again = Scene(scene.write("changed.nml"))
require(
    "what is written is read again", again["body"][0]["particles_per_cell"] == [1] and "&probe" in again.text
)
earlier = scene.copy()
for group, name in (("tool", "before"), ("probe", "gone")):
    earlier.set(group, "name", name)
earlier.set("grid", "cell_size", 0.5e-6)
earlier.remove("level")
earlier.set("output", "every", 3e-10)
before = run(earlier, progress=False)
of_before = before.snapshots
require("an earlier run in the same directory", len(of_before) == 5 and "tool_before" in before.names)
result = run(scene, progress=False)
require("it ran to its end", isinstance(result, Run) and result.finished)
require("histories", set(result.names) == {"cost", "energy", "tool_cone", "probe_under"}, result.names)
tool = result.tool()
require("a tool's history", tool.units["depth"] == "m" and tool["depth"][-1] > 0)
require("History takes a string", np.array_equal(History("read/tool_cone.dat")["time"], tool["time"]))
depth, load = result.load_depth()
require("load of the full body", np.allclose(load, 4 * tool["load_z"]) and len(depth) == tool.rows)
left = set(of_before) - set(result.snapshots)
require("the earlier run has left snapshots", len(left) >= 3 and all(path.is_file() for path in left), left)
require("three snapshots, none of the earlier run", len(result.times) == 3 and result.times[0] == 0)
require("their times grow", result.times == sorted(result.times), result.times)
require("a snapshot of this run", len(result.snapshot(1)) == len(result.snapshot(0)))
last = result.snapshot(-1)
sys.modules["pandas"] = SimpleNamespace(DataFrame=dict)  # the names matter here
table = last.frame()
named = set(table)
wanted = {"id", "mass", "position_z", "half_size", "displacement_x", "stress_xz"}
require("a column a component", wanted <= named and len(table["mass"]) == len(last), named)
require("symmetric tensors by their names", np.array_equal(table["stress_yz"], last["stress"][:, 3]))
wanted = {f"deformation_gradient_{row}{column}" for row in "xyz" for column in "xyz"}
require("columns have the names of the file", wanted <= named, named)
require("a snapshot", last.units["stress"] == "Pa" and last["stress"].shape == (len(last), 6))
require("what a scene says of itself", result.scene["tool"][0]["shape"] == ["cone"])
several = [Scene(scene.text) for _ in range(2)]
for number, one in enumerate(several):
    one.set("output", "directory", f"many_{number}")
    one.set("material", "young", 70e9 * (1 + number))
first, second = run_many(several, cores=2)
stiffer = second.tool()["load_z"][-1] / first.tool()["load_z"][-1]
require(f"many at once: the load of the stiffer one, {stiffer:.3g} times", 1.2 < stiffer < 3)
scene.set("material", "poisson", 0.7)
try:
    run(scene, progress=False)
    require("a mistake is told", False)
except RunFailed as failure:
    require(f"a mistake is told: {failure}", failure.status == 2 and "poisson=0.7" in str(failure))
try:
    Run("nowhere")
    require("no run", False)
except gimp3d.Unreadable as error:
    require("no run", "nowhere" in str(error))

def refuses(what, words, do, *kinds):
    """Whether do() ends with one of the errors `kinds`, whose sentence has the words."""
    try:
        found = do()
    except kinds or (gimp3d.Unreadable, RunFailed) as error:
        require(f"{what}: {error}", words in str(error))
    else:
        require(what, False, found)


index = Path("read/particles.xdmf")
listed = index.read_text()
index.write_text(listed.replace("particles_00000000.hdf", "particles_00000009.hdf"))
refuses("a listed snapshot that is not there", "lists particles_00000009.hdf", lambda: result.times)
index.unlink()
refuses("snapshots without their index", "there is no particles.xdmf", lambda: result.snapshot())
index.write_text(listed)


# ---- scenes as the program reads them ----

odd = """! a comment / with & signs
&scene title='it''s / a & "test" ! no', end_time=1e-10! directly behind / a value
/ &grid lower=3*0, upper=8e-6 8e-6,
 8d-6 ! it's a comment / with & signs
 cell_size = 1E-6
 boundary='symmetry',"free",'symmetry','free','roller','free' &end
&MATERIAL Name='a' Model='Elastic', Density=2710., Young=70e9, poisson=.33 /
&time safety=0.3! default 0.35 / see the manual
/
&body material='a',shape='box', lower=0,0,0, upper=6e-6,6e-6,3e-6 / &body material='a'shape='box',
lower=0,0,3e-6 ! below
, upper=2*6e-6,+6.E-6/
&output directory='odd', formats='none' /
"""


def as_run(scene, text):
    """Whether every value of a scene is that of the run of a text (its case.nml)."""
    ran = run(Scene(text), progress=False).scene
    plain = lambda values: [value.lower() if isinstance(value, str) else value for value in values]
    return all(
        len(scene[group]) == len(ran[group])
        and all(
            plain(values) == plain(there[name])
            for one, there in zip(scene[group], ran[group])
            for name, values in one.items()
        )
        for group in ("scene", "grid", "material", "time", "body")
    )


scene = Scene(odd)
require("signs in texts and comments, groups on a line: read", as_run(scene, odd), scene["body"])
scene.set("time", "flip_fraction", 0.5)
scene.set("Body", "particles_per_cell", 1)
scene.set("body", "lower", None, which=1)
scene.set("body", "LOWER", [0, 0, 3e-6], which=1)
scene.set("material", "NAME", "a")
scene.set("body", "material", "a", which=1)
require(
    "set reaches a variable behind a comment, and both groups",
    scene["time"] == [{"safety": [0.3], "flip_fraction": [0.5]}]
    and [body["particles_per_cell"] for body in scene["body"]] == [[1], [1]]
    and scene["material"][0]["name"] == ["a"],
    scene.text,
)
require("as it was set, it is run", as_run(scene, scene.text), scene.text)
require("comments stay", scene.text.count("!") == odd.count("!"), scene.text)
scene.remove("body", 1)
require("one of two groups on a line is removed", as_run(scene, scene.text), scene.text)
for text, words in (
    ("&a b=1\n&c d=2 /\n", "line 1, &a: does not end"),
    ("&a b=1 /\nm/s\n", "line 2: text outside a group"),
    ("&a b='x\n' /", "line 1, &a b: quote not closed"),
    ("&a b=1, b=2 /", "line 1, &a b: given twice"),
    ("&a\nb(1)=2 /", "line 2, &a b(1): an index"),
    ("&a b=1,,2 /", "&a b: a value is missing before a comma"),
    ("&a b= /", "&a b: no value"),
    ("&a b=nan /", "&a b=nan: no finite number"),
):
    refuses(f"refused, as by the program: {text!r}", words, lambda: Scene(text)["a"])
scene = Scene(odd)
scene.set("output", "directory", Path("odd"))
scene.set("scene", "title", "R&D, Gr\u00f6\u00dfe")
Path("R&D").mkdir()
Path("R&D/scene.nml").write_text("\ufeff" + scene.text, encoding="utf-8")
require("a path has its text", scene.directory == Path("odd") and "PosixPath" not in scene.text)
for place in ("R&D/scene.nml", Path("R&D/scene.nml")):
    read = Scene(place)
    require(f"{place!r}: a file with & in its name, and a byte order mark", read["scene"] == scene["scene"])
    read.set("scene", "end_time", 2e-10)
    require("it is changed and run", run(read, progress=False).scene["scene"][0]["end_time"] == [2e-10])
for value in (object(), float("inf"), "two\nlines", [], None):
    refuses(
        f"the value {value!r}", "cannot stand in a scene", lambda: scene.add("scene", title=value), BadSetting
    )
refuses("no such file", "nowhere.nml: No such file", lambda: Scene("nowhere.nml"))

# ---- the program, tools, columns ----

missing = "nowhere/gimp3d: there is no such program"
refuses("a program that is not there", f"program={missing}", lambda: run(scene, program="nowhere/gimp3d"))
given, os.environ["GIMP3D"] = os.environ["GIMP3D"], "nowhere/gimp3d"
refuses("one of the environment that is not there", f"GIMP3D={missing}", lambda: run(scene))
os.environ["GIMP3D"] = given
refuses("a tool that is not there", "no tool 'no'; its tools are cone", lambda: result.load_depth("no"))
refuses("its history", "no tool 'no'; its tools are cone", lambda: result.tool("no"))
for ranks in (0, -1, 1.5):
    words = f"ranks={ranks}; allowed: whole numbers from 1 on"
    refuses(f"{ranks} ranks", words, lambda: run(scene, ranks=ranks))
    refuses(f"many on {ranks} ranks", words, lambda: run_many([scene], ranks=ranks))
refuses("a quantity of a snapshot", "no 'Points'; there are position, ", lambda: last["Points"])
refuses("the same as a KeyError", "particles_", lambda: last["Points"], KeyError)
refuses("a column of a history", "tool_cone.dat: no 'depht'; there are time, ", lambda: tool["depht"])
refuses("a run without tools", "there is no tool; it has none", lambda: Run("odd").load_depth())
finish()
