"""Tools from files of few triangles, far larger than the contact: area of contact and modelled share against
those of the same tools by formulas. Plates thinner than the gaps that are looked at, and a floor that presses
upwards, with an axis that points away. usage: coarse_files.py (in an empty directory; GIMP3D is the program)
"""

from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from gimp3d import surfaces
from gimp3d.run_data import History
from run_scene import run
from checks import check, finish, require

SCENE = """&scene title='press', end_time=0.2 /
&grid lower=0,0,-1, upper=7,7,8, cell_size=1, boundary='symmetry','free','symmetry','free','{below}','free' /
&material name='m', model='elastic', density=1, young=2000, poisson=0.3 /
&body material='m', shape='box', lower=0,0,0, upper=5,5,5 /
&tool name='t', {tool}, times=0,0.05, speeds=0,6 /
{more}
&output directory='{name}', every=1, history_every=0.01 /
"""
FLOOR = "&tool name='f', {tool}, times=0, speeds=0 /"


def hull(*corners):
    """Triangles of a convex body, their corners to the left about the outward normal."""
    corners = np.array(corners, float)
    found = ConvexHull(corners)
    turned = [
        of if np.dot(np.cross(*(corners[of[1:]] - corners[of[0]])), plane[:3]) > 0 else of[::-1]
        for of, plane in zip(found.simplices, found.equations)
    ]
    return corners[np.array(turned)]


def history(name, tool, below="roller", more="", of="t"):
    run(SCENE.format(name=name, tool=tool, below=below, more=more), 1)
    return History(Path(name) / f"tool_{of}.dat")


def compare(what, found, expected):
    """The area over the time in which the other one is not 0, and the share."""
    area, right = found["contact_area"], expected["contact_area"]
    require(f"{what}: the other one has an area", right.max() > 0)
    check(f"{what}: area against that of the formula, over the largest", (area - right) / right.max(), 0.005)
    require(
        f"{what}: its modelled share is that of the formula",
        found.notes["model_share"] == expected.notes["model_share"],
        found.notes["model_share"],
    )


HIGH, PLACE = 40.0, "tip=0,0,5"
out = HIGH * np.tan(np.radians(60))
wedge = hull(*[[x, y, z] for x, z in ((0, 0), (out, HIGH), (-out, HIGH)) for y in (-300, 300)])
surfaces.write("wedge.stl", wedge)
out = HIGH * np.tan(np.radians(68))
surfaces.write("vickers.stl", hull([0, 0, 0], *[[x, y, HIGH] for x in (-out, out) for y in (-out, out)]))
surfaces.write("thin.stl", surfaces.box([-12.0, -12, 0], [12, 12, 0.5]))
surfaces.write("aside.stl", surfaces.box([0.0, 0, 0], [24, 24, 9]))
surfaces.write("floor.stl", surfaces.box([-12.0, -12, -0.9], [12, 12, 0]))

compare(
    "a wedge of 8 triangles",
    history("wedge_file", f"shape='surface', file='wedge.stl', {PLACE}"),
    history("wedge", f"shape='wedge', half_angle=60, edge=0,1,0, {PLACE}"),
)
compare(
    "a Vickers tip of 6 triangles",
    history("vickers_file", f"shape='surface', file='vickers.stl', {PLACE}"),
    history("vickers", f"shape='pyramid', faces=4, half_angle=68, {PLACE}"),
)
flat = history("flat", f"shape='flat', radius=20, {PLACE}")
compare("a thin plate", history("thin", f"shape='surface', file='thin.stl', {PLACE}"), flat)
compare(
    "a plate whose file has its origin in a corner",
    history("aside", "shape='surface', file='aside.stl', tip=-12,-12,5"),
    flat,
)
# a floor bears the body: its area is that of the whole face, whichever way its axis points
for axis in (-1, 1):
    floor = history(
        f"floor{axis}",
        f"shape='flat', radius=20, {PLACE}",
        below="free",
        more=FLOOR.format(tool=f"shape='surface', file='floor.stl', tip=0,0,0, axis=0,0,{axis}"),
        of="f",
    )
    early = (floor["load_z"] < -1) & (floor["load_z"] > -4e3)  # later the body is wider
    require(f"a floor, axis {axis}: it bears a load", early.any())
    check(f"a floor, axis {axis}: area against that of the face", floor["contact_area"][early] / 25 - 1, 0.01)
finish()
