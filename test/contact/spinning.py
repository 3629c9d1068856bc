"""A wheel with sharp teeth and hollows between them, from an STL file, turns about an axis beside its middle
and works its way into a block: no centre of a particle may be inside it, at any snapshot, but by what contact
deflects below a cell. The wheel is longer than the block is wide, so that its outline says how deep a place
is inside. Cells are 1 m. usage: spinning.py [all] (in an empty directory; GIMP3D is the program)"""

import math
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from gimp3d import surfaces
from gimp3d.run_data import History
from run_scene import run
from checks import check, finish, require
from runs import snapshots

TEETH, OUTER, INNER, BESIDE = 6, 5.0, 3.2, 0.8
CENTRE, TURN = (12.3, 13.3), -0.7  # x and z at the start, m; rad/s
END = 1.35  # s
SCENE = """&scene title='a wheel works its way into a block', end_time={end} /
&grid lower=0,0,0, upper=24,2,16, cell_size=1, boundary='roller','roller','symmetry','symmetry','roller','free' /
&time domain='{domain}' /
&material name='m', {law}, density=1, young=2000, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=24,2,8, particles_per_cell=8 /
&tool name='wheel', shape='surface', file='wheel.stl', tip={x},0,{z}, times=0,0.1, speeds=0,0.8, friction={friction} /
&motion tool='wheel', kind='turn', axis=0,1,0, point={point},0,{z}, times=0,0.1, speeds=0,{turn} /
&output directory='{name}', every={every}, history_every={every}, formats='hdf5' /
&contact subcell={subcell} /
"""
LAWS = {"neo_hookean": "model='neo_hookean'", "j2": "model='j2', yield_stress=40"}


def outline():
    """Corners (n, 2) of the wheel about its middle, in x and z, counter-clockwise seen against y."""
    angle = math.pi * np.arange(2 * TEETH) / TEETH
    radius = np.where(np.arange(2 * TEETH) % 2 == 0, OUTER, INNER)
    return radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def depth(places, corners):
    """How deep places (n, 2) are inside a closed outline, m; below 0 outside."""
    start, end = corners, np.roll(corners, -1, axis=0)
    along = end - start
    off = places[:, None] - start
    share = np.clip((off * along).sum(axis=2) / (along**2).sum(axis=1), 0, 1)
    distance = np.linalg.norm(off - share[..., None] * along, axis=2).min(axis=1)
    above = (start[:, 1] > places[:, 1, None]) != (end[:, 1] > places[:, 1, None])
    with np.errstate(all="ignore"):
        at = start[:, 0] + (places[:, 1, None] - start[:, 1]) / along[:, 1] * along[:, 0]
    inside = (above & (places[:, 0, None] < at)).sum(axis=1) % 2 == 1
    return np.where(inside, distance, -distance)


def deepest(name, sense=1):
    """Largest depth (m) of a centre inside the wheel, over all snapshots; `sense` -1: of a wheel that turns
    the other way."""
    history = History(Path(name) / "tool_wheel.dat")
    worst = -math.inf
    for snapshot in snapshots(name):
        n = np.argmin(np.abs(history["time"] - snapshot.time))
        angle = sense * 2 * math.atan2(history["rotation_y"][n], history["rotation_w"][n])  # z goes towards x
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        point = np.array([history["position_x"][n], history["position_z"][n]])
        corners = point + (outline() - [BESIDE, 0]) @ turn.T
        worst = max(worst, depth(snapshot.fields["position"][:, [0, 2]], corners).max())
    return worst


known = depth(np.array([[0.0, 0.0], [OUTER - 1e-3, 0.0], [OUTER + 1e-3, 0.0], [0.0, OUTER]]), outline())
require(
    "depth: the middle, both sides of a tooth, between teeth",
    known[0] > 0.9 * INNER / 2 and known[1] > 0 > known[2] and known[3] < -1,
)
surfaces.write(
    "wheel.stl", surfaces.prism([tuple(c) for c in outline()], -2.0, 6.0)[:, :, [0, 2, 1]] * [1, -1, 1]
)
ALL = [
    (law, domain, friction, subcell)
    for law, subcell in (("neo_hookean", 0.35), ("neo_hookean", 0), ("j2", 0.35))
    for domain in ("fixed", "stretch", "corners")
    for friction in (0.0, 0.3)
]
FEW = [case for case in ALL if case[0] == "j2" and case[1] != "fixed"]
for law, domain, friction, subcell in ALL if sys.argv[1:] == ["all"] else FEW:
    name = f"{law}_{domain}_{friction:g}" + ("" if subcell else "_without")
    run(
        SCENE.format(
            name=name,
            domain=domain,
            law=LAWS[law],
            friction=friction,
            subcell=subcell,
            end=END,
            every=END / 54,
            turn=TURN,
            x=CENTRE[0],
            z=CENTRE[1],
            point=CENTRE[0] + BESIDE,
        ),
        1,
    )
    wheel = History(Path(name) / "tool_wheel.dat")
    require(
        f"{name}: the wheel bears load and is turned",
        np.abs(wheel["load_z"]).max() > 100 and abs(wheel["spin_y"][-1] - TURN) < 1e-9,
    )
    worst = deepest(name)
    print(f"   {name}: centres come to {-worst:.4f} cells from the wheel")
    # with the compliance below a cell faces stand inside the tool by their deflection: half a cell in rubber,
    # whose pressure at the teeth is that of its modulus
    inside = max(worst - wheel["max_deflection"].max(), 0.0)
    check(f"{name}: deepest centre inside the wheel, less the deflection [cells]", inside, 0.01)
    if law == "j2":  # rubber comes back, and its hollows suit either way
        require(f"{name}: in a wheel that turns the other way there are some", deepest(name, -1) > 0.1)
finish()
