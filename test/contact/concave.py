"""Dies from files whose faces meet at sharp concave edges: metal confined in one file presses as in one
file a face, and by the law; in explicit and quasi-static steps, with friction, and in a cavity of three
faces. In quasi-static steps a particle under two tools began each step with the pressure of both at each:
the energy was 2.8 % off, and in steps a fifth as long 16 %, the load 8 % too high. usage: concave.py (in
an empty directory; GIMP3D is the program)"""

from pathlib import Path

import numpy as np

from gimp3d import surfaces
from gimp3d.run_data import History
from run_scene import run
from checks import check, finish

YOUNG, POISSON, YIELD = 70e9, 0.3, 200e6
METAL = f"model='j2', density=2710, young={YOUNG}, poisson={POISSON}, yield_stress={YIELD}"


def solid(name, inside, *lines):
    """Write the surface of the boxes between the `lines` along x, y, z (mm) that are `inside`."""
    triangles = []
    filled = np.zeros([len(line) + 1 for line in lines], bool)
    for at in np.ndindex(*[len(line) - 1 for line in lines]):
        middle = [0.5 * (line[i] + line[i + 1]) for line, i in zip(lines, at)]
        filled[tuple(np.array(at) + 1)] = inside(*middle)
    for at in zip(*np.nonzero(filled)):
        for axis in range(3):
            for side in (0, 1):
                beside = list(at)
                beside[axis] += 2 * side - 1
                if filled[tuple(beside)]:
                    continue
                low = [line[i - 1] for line, i in zip(lines, at)]
                high = [line[i] for line, i in zip(lines, at)]
                low[axis] = high[axis] = (low, high)[side][axis]
                j, k = (axis + 1) % 3, (axis + 2) % 3
                corners = [list(low) for _ in range(4)]
                corners[1][j] = corners[2][j] = high[j]
                corners[2][k] = corners[3][k] = high[k]
                order = (0, 1, 2, 3) if side else (0, 3, 2, 1)
                quad = [corners[n] for n in order]
                triangles += [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    surfaces.write(name, np.array(triangles))


def pressed(name, tools, more, width=1e-3, end=8e-5, ranks=1):
    """Pressure (Pa) and depth (m) of the punch at the end: a slice, or a quarter of a block."""
    upper, side = ("6e-3,1e-3,9e-3", "symmetry") if width < 2e-3 else ("6e-3,6e-3,9e-3", "free")
    text = (
        f"&scene title='{name}', end_time={end} /\n"
        f"&grid lower=0,0,-1e-3, upper={upper}, cell_size=1e-3, "
        f"boundary='symmetry','free','symmetry','{side}','free','free' /\n"
        f"&material name='m', {METAL} /\n"
        f"&body material='m', shape='box', lower=0,0,0, upper=4e-3,{width},6e-3 /\n"
        + "".join(
            f"&tool name='{tool.split('.')[0]}', shape='surface', file='{tool}', scale=1e-3, tip=0,0,0, "
            f"axis=0,0,1, times=0, speeds=0{friction} /\n"
            for tool, friction in tools
        )
        + "&tool name='punch', shape='flat', radius=50e-3, tip=0,0,6e-3, axis=0,0,-1, times=0,2e-5,1e-4, "
        "speeds=0,2,2 /\n"
        f"{more}\n&output directory='{name}' /\n"
    )
    run(text, ranks)
    history = History(Path(name) / "tool_punch.dat")
    return history["load_z"][-1] / (4e-3 * width), history["depth"][-1]


def by_law(depth):
    """Confined compression, logarithmic strains: K e + 2/3 Y."""
    return YOUNG / 3 / (1 - 2 * POISSON) * -np.log(1 - depth / 6e-3) + 2 / 3 * YIELD


along, up = (-2.0, 4.0, 7.0), (-1.0, 0.0, 9.0)
solid("die.stl", lambda x, y, z: x > 4 or z < 0, along, (-1.0, 2.0), up)
solid("floor.stl", lambda x, y, z: z < 0, along, (-1.0, 2.0), up)
solid("wall.stl", lambda x, y, z: x > 4, along, (-1.0, 2.0), up)
solid("cup.stl", lambda x, y, z: x > 4 or y > 4 or z < 0, along, along, up)
damped = "&damping kind='viscous', coefficient=1e5 /"
static = "&quasi_static step=2e-6, max_step=5e-6 /"
for name, more, friction in (
    ("explicit", damped, ""),
    ("static", static, ""),
    ("rubbed", static, ", friction=0.1"),
):
    one, depth = pressed(f"{name}_one", [("die.stl", friction)], more)
    two, _ = pressed(f"{name}_two", [("floor.stl", friction), ("wall.stl", friction)], more)
    check(f"{name}: pressure in one file against that in a file a face", one / two - 1, 1e-6)
    if not friction:
        check(f"{name}: pressure by the law", one / by_law(depth) - 1, 0.008)
    energy = History(Path(f"{name}_one") / "energy.dat")
    check(f"{name}: energy balance", energy["balance_error"][-1], 0.002)
cup, depth = pressed("cup", [("cup.stl", "")], damped, width=4e-3, end=5e-5, ranks=2)
check("cup of three faces on two ranks: pressure by the law", cup / by_law(depth) - 1, 0.01)
finish()
