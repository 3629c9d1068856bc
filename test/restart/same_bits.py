"""Straight runs against runs that are stopped and go on.   usage: same_bits.py [long]"""

import re
import shutil
import sys
import h5py
from restarts import *

ENDS = {"levels": 0.025, "splitting": 0.09, "plastic": 0.03, "moving": 0.085, "resting": 0.15}
TEXTS = {"levels": LEVELS, "splitting": SPLITTING, "plastic": PLASTIC, "moving": MOVING, "resting": RESTING}
LONG = sys.argv[1:] == ["long"]
if not LONG:
    del TEXTS["resting"], TEXTS["plastic"]


def chain(name, text, directory, ranks, straight):
    """Stop after a first checkpoint on each number of ranks but the last."""
    stops = []
    for position, n in enumerate(ranks):
        first = position == 0
        if position == len(ranks) - 1:
            output = run(n, restart=directory)
            require(f"{name}: says where it goes on", "goes on    from" in output)
            continue
        status, output = part_run(n, directory, text if first else None, None if first else directory)
        for _ in range(4 if first else 0):  # on a busy machine the run may end before the signal comes
            if status == 0:
                status, output = part_run(n, directory, text)
        if status not in (0, 5):
            require(f"{name} on {n} ranks: status {status}: {output[-500:]}", False)
        if status == 0:
            break
        stops.append(newest_step(directory))
    require(
        f"{name}, ranks {ranks}: stopped at steps {stops}", len(stops) >= 1 and stops == sorted(set(stops))
    )
    return same(f"{name}, ranks {ranks}", straight, directory)


for name, text in TEXTS.items():
    straight = f"{name}_straight"
    log = run(1, scene(text, straight, end=ENDS[name]), what=name)
    whole = everything(sorted(Path(straight).glob("particles_*.hdf"))[-1])
    if name == "splitting":
        first = everything(sorted(Path(straight).glob("particles_*.hdf"))[0])
        require(
            "splitting: particles were split",
            len(whole["VTKHDF/PointData/id"]) > len(first["VTKHDF/PointData/id"]),
        )
    if name == "resting":
        require("resting: blocks were at rest", "at rest: " in log)
    if name == "plastic":
        require("plastic: there was plastic flow", whole["VTKHDF/PointData/plastic_strain"].max() > 1e-3)
    if name == "levels":
        require("levels: particles on both", set(whole["VTKHDF/PointData/level"].ravel()) == {1.0, 2.0})
    if name == "moving":
        chain(
            name, scene(text, f"{name}_0", "every_steps=47", end=ENDS[name]), f"{name}_0", [1, 1, 1], straight
        )
        with h5py.File(checkpoints(f"{name}_0")[-1]) as file:
            require("moving: the level has moved", file["state/counts"][1] > 0)
        continue
    chain(name, scene(text, f"{name}_1", "every_steps=9", end=ENDS[name]), f"{name}_1", [1, 1, 1], straight)
    if name == "levels":  # what the next placement of blocks asks: their lists, over the last steps
        run(1, scene(text, "levels_kept", "every_steps=9", end=ENDS[name]))
        bounds = []
        for directory in ("levels_kept", "levels_1"):
            with h5py.File(checkpoints(directory)[-1]) as file:
                bounds.append(file["blocks/bounds"][:])
        require("levels: lists have jumped", bounds[0][:, 10].max() > 0)
        require(
            "levels: blocks of the last checkpoint",
            newest_step("levels_kept") == newest_step("levels_1") and np.array_equal(*bounds),
        )
    if name != "splitting":
        chain(name, scene(text, f"{name}_2", "every_steps=11", end=ENDS[name]), f"{name}_2", [2, 2], straight)
    chain(
        name, scene(text, f"{name}_m", "every_steps=7", end=ENDS[name]), f"{name}_m", [1, 2, 4, 1], straight
    )

# contact: the same bits on the same ranks; to the tolerance of its solver on others
for ranks in (1, 2):
    straight = f"contact_straight_{ranks}"
    run(ranks, scene(CONTACT, straight, end=0.02, every=0.01))
    chain(
        f"contact on {ranks}",
        scene(CONTACT, f"contact_{ranks}", "every_steps=8", end=0.02, every=0.01),
        f"contact_{ranks}",
        [ranks, ranks],
        straight,
    )
# levels that follow a tool, or that the estimated error places: a run that goes on looks at the same times
PLACED = re.sub(r"&level lower.*", "&level criterion='error', max_cells=8000 /", FOLLOWING)
for name, text in (("following", FOLLOWING_PARTS), ("placed", PLACED)) if LONG else ():
    run(1, scene(text, f"{name}_straight", end=0.02, every=0.01))
    chain(
        f"a level that is {name}",
        scene(text, name, "every_steps=7", end=0.02, every=0.01),
        name,
        [1, 1, 1],
        f"{name}_straight",
    )
    with h5py.File(checkpoints(name)[-1]) as file:
        require(f"{name}: the level has moved", file["state/counts"][1] > 0)

# candidates on four ranks, flow below them: from 1 to 2 to 4 to 1
run(1, scene(SPREAD, "spread_straight", end=0.04, every=0.01))
text, stops = scene(SPREAD, "spread", "every_steps=8", end=0.04, every=0.01), []
for n in (1, 2, 4):
    part_run(n, "spread", text if not stops else None, "spread" if stops else None)
    stops.append(newest_step("spread"))
run(1, restart="spread")
require(f"contact from 1 to 2 to 4 to 1 ranks: stopped at steps {stops}", stops == sorted(set(stops)))
heads = ["TITLE", "VARIABLES", "ZONE", "AUXDATA"]
a, b = (np.loadtxt(f"{name}/tool_ball.dat", comments=heads) for name in ("spread_straight", "spread"))
require(
    "contact from 1 to 2 to 4 to 1 ranks: as many rows, at the same times and depths",
    a.shape == b.shape and np.array_equal(a[:, :2], b[:, :2]) and len(a) > 30,
)
if a.shape == b.shape:
    off = np.abs(a[:, 2:5] - b[:, 2:5]).max() / np.abs(a[:, 2:5]).max()
    require(f"contact from 1 to 2 to 4 to 1 ranks: loads differ by {off:.1e} of the largest", off < 1e-5)
part_run(4, "spread_on_4", scene(SPREAD, "spread_on_4", "every_steps=30", end=0.04, every=0.01))
with h5py.File(checkpoints("spread_on_4")[-1]) as file:
    table = file["blocks/table"][...]
    owner = np.repeat(table[:, 3], table[:, 2])
    touching = file["particles/contact_pressure"][...].ravel() > 0
    require(
        f"contact on 4 ranks: {touching.sum()} particles touch, on ranks "
        f"{sorted(set(owner[touching].tolist()))}",
        len(set(owner[touching])) == 4,
    )
whole = everything(sorted(Path("spread").glob("particles_*.hdf"))[-1])
require("spread: there was plastic flow", whole["VTKHDF/PointData/plastic_strain"].max() > 1e-3)

# what compares bits must see one
shutil.copytree("levels_straight", "planted")
with h5py.File(sorted(Path("planted").glob("particles_*.hdf"))[-1], "r+") as file:
    file["VTKHDF/Points"][5, 1] = np.nextafter(file["VTKHDF/Points"][5, 1], 9)
require("planted: one changed bit is noticed", len(differences("levels_straight", "planted")) == 1)
finish()
