"""The package gimp3d beside what a run wrote."""

from pathlib import Path

import numpy as np

import gimp3d
from gimp3d import History, Run, RunFailed, Scene, run, run_many
from checks import finish, require


scene = Scene("readers.nml")
require("a scene is read", scene["material"][0]["young"] == [70e9] and scene.directory == Path("read"))
scene.set("output", "formats", ["hdf5"])
scene.set("body", "particles_per_cell", np.int64(1))
scene.set("scene", "end_time", np.float64(scene["scene"][0]["end_time"][0]))
scene.set("body", "velocity", np.zeros(3))
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
finish()
