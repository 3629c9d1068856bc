"""Rigid tools on an elastic cylinder, by the section on levels, beside finite elements (test/references/fem) at
cells of 1 to 0.125 um under the tool: loads and the radius of contact.
usage: section_fem.py CELL... (um; in an empty directory; GIMP3D is the program)"""

import sys
from pathlib import Path

import numpy as np
from checks import check, finish
from run_scene import ROOT, run
from runs import energy
from gimp3d.run_data import History

SCENE = """&scene title='{name}', end_time={time} /
&grid geometry='axisymmetric', lower=0,0, upper={top}e-6,{top}e-6, cell_size={base}e-6, boundary='symmetry','free','roller','free' /
{levels}&time domain='{domain}' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6 /
&tool name='tool', {tool}, tip=0,0,20e-6, axis=0,0,-1, times=0,1e-8, speeds=0,{speed} /
{contact}
&output directory='{name}', formats='none' /
"""
# how far each level reaches from the axis, down from the surface, up from it, um
LEVELS = ((8, 8, 2), (5, 5, 1), (3.5, 3.5, 0.5), (2.75, 2.75, 0.5))
TOOLS = {
    # shape, speed (m/s), time (s), tables of finite elements from coarse to fine, their order, domain
    "sphere": ("shape='sphere', radius=10e-6", 20, 3e-8, ("h0.1", "h0.05"), "fixed"),
    "cone": ("shape='cone', half_angle=70.3", 27, 3.463e-8, ("h0.05", "h0.025"), "corners"),
    "flat": ("shape='flat', radius=2e-6", 1.5, 3.833e-8, ("h0.05", "h0.025"), "fixed"),
}


def reference(kind, which):
    return np.loadtxt(ROOT / f"test/references/fem/{kind}_hypo_{which}.csv", delimiter=",", comments="#")


def exact(kind, depth):
    """The load (uN) at depths (um): of a punch, whose error falls with the element, what its tables go to."""
    coarse, fine = (reference(kind, which) for which in TOOLS[kind][3])
    load = 2 * fine[:, 1] - coarse[:, 1] if kind == "flat" else fine[:, 1]
    power = {"flat": 1.0, "sphere": 1.5, "cone": 2.0}[kind]  # between the tables' depths
    return np.interp(depth, fine[:, 0], load / fine[:, 0] ** power) * depth**power


def radius_of(kind, depth):
    """Radius of the contact (um): a table's goes in steps of an element."""
    if kind == "flat":
        return np.full_like(depth, 2.0)
    fine = reference(kind, TOOLS[kind][3][1])
    power = {"sphere": 0.5, "cone": 1.0}[kind]
    late = fine[:, 0] > 0.4 * fine[-1, 0]
    return np.mean(fine[late, 2] / fine[late, 0] ** power) * depth**power


def press(kind, cell, contact="", base=1.0):
    """A run on levels, each of half the cells, from the cell `base` to `cell`, um: what is off, per cent."""
    tool, speed, time, _, domain = TOOLS[kind]
    name = f"{kind}_{cell:g}{'_without' if contact else ''}"
    levels = ""
    for n, reach in enumerate(LEVELS[: round(np.log2(base / cell))]):
        edge = base / 2**n  # of what is refined
        wide, down, up = (np.ceil(length / edge - 1e-9) * edge for length in reach)
        levels += f"&level lower=0,0,{20 - down:g}e-6, upper={wide:g}e-6,0,{20 + up:g}e-6 /\n"
    scene = SCENE.format(
        name=name,
        time=time,
        levels=levels,
        domain=domain,
        tool=tool,
        speed=speed,
        contact=contact,
        base=f"{base:.15g}",
        top=f"{20 + np.ceil(2 / base - 1e-9) * base:.15g}",
    )
    run(scene, 1)
    rows, balance = History(Path(name) / "tool_tool.dat"), energy(name)
    depth = rows["depth"] * 1e6
    late = depth > 0.5 * depth[-1]
    off = 100 * (rows["load_z"][late] * 1e6 / exact(kind, depth[late]) - 1)
    wide = np.sqrt(rows["contact_area"][late] / np.pi) * 1e6
    wide = 100 * (wide / radius_of(kind, depth[late]) - 1)
    return off.mean(), off.std(), wide.mean(), np.sqrt((wide**2).mean()), 100 * balance["balance_error"][-1]


def main():
    print("| tool | cell [nm] | load: mean, scatter [%] | radius: mean, rms [%] | energy [%] |")
    for kind in TOOLS:
        for cell in map(float, sys.argv[1:]):
            mean, scatter, wide, rms, lost = press(kind, cell)
            print(
                f"| {kind} | {1e3 * cell:g} | {mean:+.2f}, {scatter:.2f} | {wide:+.1f}, {rms:.1f} | "
                f"{lost:+.2f} |",
                flush=True,
            )
            bound = 1.0 if cell > 0.125 else 0.3
            if cell <= 0.5:
                check(f"{kind}, {cell:g} um: mean error of the load, %", mean, bound)
                check(f"{kind}, {cell:g} um: mean error of the radius, %", wide, 2.0)
    finish()


if __name__ == "__main__":
    main()
