"""Bodies of two groups that fit each other: they press by nothing where nothing acts, and by Lame's pressure
where one is too large (theory.md, eqs surface-element, partner-gap).
usage: fits.py [long] (in an empty directory; GIMP3D is the program)"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from run_scene import History, run
from checks import check, finish

YOUNG, NU, RADIUS = 210e9, 0.3, 20e-3
STEEL = f"&material name='steel', model='elastic', density=7800, young={YOUNG}, poisson={NU} /\n"
STATIC = "&quasi_static step=0.25, max_step=0.25 /\n"


def mean_force(name, pair, after):
    rows = History(Path(name) / f"contact_{pair}.dat")
    late = rows["time"] > after
    return np.abs([rows[f"force_{axis}"][late].mean() for axis in "xyz"])


def write_ball(path, radius, count):
    """A ball of triangles between places on a sphere."""
    k = np.arange(count) + 0.5
    height, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    around = np.sqrt(1 - height**2)
    places = radius * np.stack([around * np.cos(angle), around * np.sin(angle), height], axis=1)
    hull = ConvexHull(places)
    lines = ["solid ball"]
    for corners, plane in zip(hull.simplices, hull.equations):
        a, b, c = places[corners]
        if np.dot(np.cross(b - a, c - a), plane[:3]) < 0:
            b, c = c, b
        lines += ["facet normal {} {} {}".format(*plane[:3]), "outer loop"]
        lines += ["vertex {!r} {!r} {!r}".format(*map(float, corner)) for corner in (a, b, c)]
        lines += ["endloop", "endfacet"]
    Path(path).write_text("\n".join([*lines, "endsolid ball"]) + "\n")


def ball_in_a_socket(particles, triangles=0, strain=0.0):
    """Mean pressures (Pa) of an eighth of a ball, four cells a radius, in a socket of its radius, along the axes;
    or of triangles. `strain`: how much larger the ball is, over its radius."""
    name, radius, outer = f"socket_{particles}_{triangles}_{strain}", 8e-3, 14e-3
    surface = []
    for body, size in ("ball", radius * (1 + strain / 2)), ("hole", radius * (1 - strain / 2)):
        surface.append(f"shape='sphere', center=0,0,0, radius={size!r}")
        if triangles:
            write_ball(f"{body}.stl", size, triangles // 2 + 2)
            surface[-1] = f"shape='surface', file='{body}.stl'"
    fit = "&body_contact groups='a','b', start='as_is', press_fit=0.25 /\n" if strain > 0 else ""
    run(
        "&scene title='ball in a socket', end_time=0.5 /\n"
        "&grid lower=0,0,0, upper=16e-3,16e-3,16e-3, cell_size=2e-3, "
        "boundary='symmetry','free','symmetry','free','symmetry','free' /\n"
        + STEEL
        + f"&body name='a', material='steel', {surface[0]}, fill='share', "
        f"particles_per_cell={particles}, contact_group='a' /\n"
        f"&body name='b', material='steel', shape='sphere', center=0,0,0, radius={outer}, "
        f"particles_per_cell={particles}, contact_group='b' /\n"
        f"&cut body='b', {surface[1]} /\n"
        + fit
        + STATIC
        + f"&output directory='{name}', history_every=0.1, formats='none' /\n",
        2 if strain > 0 else 1,
    )
    pressure = mean_force(name, "a_b", 0.4) / (np.pi / 4 * radius**2)
    if not strain > 0:
        check(f"{name}, nothing acts: pressure over 1e-6 E", pressure / 2.1e5, 1e-3)
        return
    shell = ((1 - 2 * NU) * radius**3 + (1 + NU) * outer**3 / 2) / (outer**3 - radius**3)
    lame = strain * YOUNG / (1 - 2 * NU + shell)
    check(f"{name}, press fit: pressure over Lame", pressure / lame - 1, 0.01)


def rings(name, cell, interference, explicit=False):
    """Mean pressure between a ring and a hub (m: how much larger its radius is), over Lame's."""
    end = 3e-4 if explicit else 1
    fits = interference / 2
    fit = f", start='as_is', press_fit={0.5 * end}" if interference > 0 else ""
    run(
        f"&scene title='{name}', end_time={end} /\n"
        f"&grid lower=0,0,0, upper=32e-3,32e-3,{cell}, cell_size={cell}, "
        "boundary='symmetry','free','symmetry','free','symmetry','symmetry' /\n"
        + STEEL
        + f"&body name='ring', material='steel', shape='cylinder', center=0,0,0, radius={RADIUS + fits!r}, "
        f"height={cell}, contact_group='inner' /\n"
        "&cut body='ring', shape='cylinder', center=0,0,-5e-3, radius=10e-3, height=15e-3 /\n"
        f"&body name='hub', material='steel', shape='cylinder', center=0,0,0, radius=30e-3, height={cell}, "
        "contact_group='outer' /\n"
        f"&cut body='hub', shape='cylinder', center=0,0,-5e-3, radius={RADIUS - fits!r}, height=15e-3 /\n"
        f"&body_contact groups='inner','outer'{fit} /\n"
        + ("&damping kind='viscous', coefficient=1e5 /\n" if explicit else STATIC)
        + f"&output directory='{name}', history_every={end / 100}, formats='none' /\n",
        1,
    )
    lame = max(abs(interference), 1e-6) * YOUNG / (1 - NU**2) / (RADIUS * (1300 / 500 + 500 / 300))
    return mean_force(name, "inner_outer", 0.85 * end)[:2] / (RADIUS * cell) / lame


ball_in_a_socket(8)
ball_in_a_socket(8, triangles=1276)
ball_in_a_socket(8, triangles=1276, strain=1e-3)
check("rings that fit, pressure over that of 1 um", rings("none", 2e-3, 0.0), 1e-6)
check("control: rings 1 um apart do not press", rings("apart", 2e-3, -1e-6), 0.0)
check("press fit of 2.5 um, cells of 2 mm: over Lame", rings("fit", 2e-3, 2.5e-6) - 1, 0.01)
if sys.argv[1:] == ["long"]:
    ball_in_a_socket(1)
    ball_in_a_socket(8, strain=1e-3)
    ball_in_a_socket(8, triangles=1276, strain=1e-4)
    ball_in_a_socket(8, triangles=5116, strain=1e-3)
    for um in (2.5, 5, 25):
        for mm in (2, 1):
            name = f"fit_{um}_{mm}"
            off = rings(name, mm * 1e-3, um * 1e-6) - 1
            check(f"press fit of {um} um, cells of {mm} mm: over Lame", off, 0.01)
        off = rings(f"explicit_{um}", 2e-3, um * 1e-6, explicit=True) - 1
        check(f"press fit of {um} um, cells of 2 mm, explicit: over Lame", off, 0.01)
    check("rings that fit, explicit", rings("none_explicit", 2e-3, 0.0, explicit=True), 1e-3)
finish()
