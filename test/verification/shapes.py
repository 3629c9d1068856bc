"""Bodies of any shape against exact answers (theory.md, eqs cut-cell, pressure, first-stress).
usage: shapes.py (in an empty directory; GIMP3D is the program)"""

import math

import numpy as np

from run_scene import run
from checks import check, finish, require
from runs import energy, snapshots, vector

from gimp3d import surfaces

LAW = "&material name='m', model='elastic', density=1000, young=1e6, poisson=0.3 /\n"


def grid(cells, cell=1.0, lower=0.0, boundary="'free'"):
    upper = [lower + n * cell for n in cells]
    return (
        f"&grid lower={lower!r},{lower!r},{lower!r}, upper={','.join(repr(x) for x in upper)}, "
        f"cell_size={cell!r}, boundary={boundary if ',' in boundary else '6*' + boundary} /\n"
    )


def volumes():
    """Shares of particles add up to the volume, wherever the lattice lies. Without them the same bodies are
    off by more."""
    surfaces.write("ball.stl", surfaces.sphere(5.0, 0.5))
    surfaces.write("ball.obj", surfaces.sphere(5.0, 0.5))
    ball = (
        abs(np.einsum('ij,ij->i', (t := surfaces.sphere(5.0, 0.5))[:, 0], np.cross(t[:, 1], t[:, 2])).sum())
        / 6
    )
    a, r, h = math.radians(35), 1.0, 9.0
    apex, cap = r * (1 / math.sin(a) - 1), r * (1 - math.sin(a))
    cone = (
        math.pi
        / 3
        * (
            ((h + apex) * math.tan(a)) ** 2 * (h + apex)
            - (r * math.cos(a)) ** 2 * (cap + apex)
            + cap**2 * (3 * r - cap)
        )
    )
    bodies = {
        "tube": (
            "shape='cylinder', center=0.2,0.1,-4.03, radius=6.13, height=8.11",
            "&cut body='b', shape='cylinder', center=0.2,0.1,-5, radius=3.27, height=11 /\n",
            math.pi * (6.13**2 - 3.27**2) * 8.11,
        ),
        "tilted": (
            "shape='cylinder', center=-2,-2,-2, radius=4.2, height=5.5, axis=1,2,3, fill='share'",
            "",
            math.pi * 4.2**2 * 5.5,
        ),
        "cone": (
            "shape='cone', tip=0.3,0.2,-4.9, axis=0.1,0.2,-1, half_angle=35, height=9, tip_radius=1",
            "",
            cone,
        ),
        "pyramid": (
            "shape='pyramid', tip=0.3,0.2,-4.9, axis=0.1,0.2,-1, faces=4, half_angle=30, height=8",
            "",
            4 * 8**3 * math.tan(math.radians(30)) ** 2 / 3,
        ),
        "ball": ("shape='surface', file='ball.stl', origin=0.3,0.2,-4.9, rotation=10,20,30", "", ball),
        "obj": (
            "shape='surface', file='ball.obj', scale=1, origin=0.3,0.2,-4.9, rotation=10,20,30",
            "",
            ball,
        ),
        "drilled": (
            "shape='box', lower=-4,-4,-4, upper=4,4,4",
            "&cut body='b', shape='sphere', center=0.1,0.2,0.3, radius=2.9 /\n"
            "&cut body='b', shape='cone', tip=0,0,-3.9, axis=0,0,-1, half_angle=20, height=1.5 /\n",
            512 - 4 / 3 * math.pi * 2.9**3 - math.pi / 3 * 1.5**3 * math.tan(math.radians(20)) ** 2,
        ),
    }
    for name, (shape, cut, exact) in bodies.items():
        for particles in (1, 8):
            text = (
                "&scene title='fill', end_time=1e-9 /\n"
                + grid((20, 20, 20), 1.0, -10.0)
                + LAW
                + f"&body name='b', material='m', {shape}, particles_per_cell={particles} /\n"
                + cut
                + f"&output directory='{name}_{particles}' /\n"
            )
            run(text, 1)
            p = snapshots(f"{name}_{particles}")[0].fields
            check(
                f"{name}, {particles} a cell: volume of the particles against the exact one",
                p["volume"].sum() / exact - 1,
                5e-3,
            )
            check(f"{name}, {particles} a cell: mass", p["mass"].sum() / (1000 * exact) - 1, 5e-3)
            least = p["volume"].min() / (1.0 / particles)
            require(
                f"{name}, {particles} a cell: no particle is a sliver ({least:.3f})",
                least >= 0.2 * (1 - 1e-9),
            )
    one, other = snapshots("ball_8")[0].fields, snapshots("obj_8")[0].fields
    check("the same surface as STL and OBJ", one["volume"].sum() / other["volume"].sum() - 1, 1e-6)


def force_of(name, body, cut, box, exact):
    """All of the momentum that a pressure makes in a short time; so small that nothing moves."""
    text = (
        "&scene title='push', end_time=0.2 /\n"
        + grid((20, 20, 20), 1.0, -10.0)
        + LAW
        + f"&body name='b', material='m', {body} /\n"
        + cut
        + f"&pressure lower={box[0]}, upper={box[1]}, times=0, values=1e-6 /\n"
        + f"&output directory='{name}', formats='none', history_every=1e-9 /\n"
    )
    run(text, 2)
    rows = energy(name)
    off = vector(rows, "momentum")[-1] / (1e-6 * rows["time"][-1]) - exact
    check(
        f"{name}: force of a pressure of 1 over the size of the exact one", off / np.linalg.norm(exact), 5e-3
    )


def pressures():
    """On half of a curved surface the force is the pressure times the area across it."""
    force_of(
        "half_ball",
        "shape='surface', file='ball.stl', origin=0.03,0.04,-5",
        "",
        ("-8,-8,0.002", "8,8,8"),
        np.array([0, 0, -0.5 * 64 * 25 * math.sin(2 * math.pi / 64)]),
    )
    tube = "shape='cylinder', center=0,0,-4, radius=6.1, height=8"
    bore = "&cut body='b', shape='cylinder', center=0,0,-5, radius=3.3, height=11 /\n"
    force_of("half_bore", tube, bore, ("0,-4,-8", "4,4,8"), np.array([2 * 3.3 * 8, 0, 0]))
    # one face of a block alone, though the box holds edges
    force_of(
        "one_face",
        "shape='box', lower=-4,-4,-4, upper=4,4,4, fill='share'",
        "",
        ("-6,-6,3.9", "6,6,5"),
        np.array([0, 0, -64.0]),
    )


def a_fifth():
    """What a cut leaves of a layer of particles is a fifth, by rounding more or less: it is there once."""
    for cut in (5.2e-3, 4.2e-3):
        text = (
            "&scene title='fifth', end_time=1e-12 /\n"
            "&grid lower=0,0,0, upper=14e-3,14e-3,14e-3, cell_size=2e-3,\n"
            "      boundary='symmetry','free','symmetry','free','symmetry','free' /\n"
            "&material name='m', model='elastic', density=1000, young=1e9, poisson=0.3 /\n"
            "&body name='b', material='m', shape='box', lower=0,0,0, upper=10e-3,10e-3,10e-3 /\n"
            f"&cut body='b', shape='box', lower={cut},-1e-3,-1e-3, upper=20e-3,20e-3,20e-3 /\n"
            "&output directory='fifth' /\n"
        )
        run(text, 1)
        mass = snapshots("fifth")[-1].fields["mass"].sum()
        check(f"cut at {cut} m: mass, less 1", mass / (1000 * cut * 1e-4) - 1, 1e-9)


def warned():
    """A cone of four particles misses a fourth of its volume, and the run says so; a ball misses little."""
    slim = "shape='cone', tip=0.1,0.2,2.2, axis=0,0,1, half_angle=12, height=3, particles_per_cell=1"
    for name, shape in (("slim", slim), ("ball", "shape='sphere', center=0.1,0.2,0.3, radius=2")):
        text = (
            f"&scene title='{name}', end_time=1e-9 /\n"
            + grid((10, 10, 10), 1.0, -5.0)
            + LAW
            + f"&body name='b', material='m', {shape} /\n"
        )
        said = "WARNING: volume and mass of b" in run(text, 1)
        require(f"{name}: {'' if said else 'not '}warned of", said == (name == "slim"))


def lame():
    """A tube with a wall of 8 cells under inner pressure. Beside the surfaces a cell's nodes see what is not
    there."""
    a, b, p, cell = 4e-2, 12e-2, 100e6, 1e-2
    text = (
        "&scene title='tube', end_time=1e-3 /\n"
        + grid((14, 14, 1), cell, 0.0, "'symmetry','free','symmetry','free','symmetry','symmetry'")
        + "&time domain='corners' /\n&material name='m', model='elastic', density=7800, young=200e9, "
        "poisson=0.3 /\n"
        + f"&body name='b', material='m', shape='cylinder', center=0,0,0, radius={b}, height={cell} /\n"
        + f"&cut body='b', shape='cylinder', center=0,0,-1, radius={a}, height=2 /\n"
        + f"&pressure lower=0,0,0, upper={1.1 * a},{1.1 * a},{cell}, times=0,2e-4, values=0,{p} /\n"
        + "&damping kind='local', coefficient=0.2 /\n&output directory='lame' /\n"
    )
    run(text, 1)
    last = snapshots("lame")[-1].fields
    x, stress = last["position"], last["stress_recovered"]
    r = np.hypot(x[:, 0], x[:, 1])
    n = x[:, :2] / r[:, None]
    xy = stress[:, 5] if np.abs(stress[:, 5]).max() > np.abs(stress[:, 3]).max() else stress[:, 3]
    radial = stress[:, 0] * n[:, 0] ** 2 + stress[:, 1] * n[:, 1] ** 2 + 2 * xy * n[:, 0] * n[:, 1]
    hoop = stress[:, 0] * n[:, 1] ** 2 + stress[:, 1] * n[:, 0] ** 2 - 2 * xy * n[:, 0] * n[:, 1]
    k = p * a**2 / (b**2 - a**2)
    within = (r > a + cell) & (r < b - cell)
    check(
        "Lame: hoop stress a cell and more from the surfaces",
        (hoop / (k * (1 + b**2 / r**2)) - 1)[within],
        0.03,
    )
    check("Lame: radial stress there, over p", ((radial - k * (1 - b**2 / r**2)) / p)[within], 0.03)
    inner = r < a + 0.5 * cell
    check(
        "Lame: hoop stress of the first half cell, in the mean",
        (hoop / (k * (1 + b**2 / r**2)) - 1)[inner].mean(),
        0.1,
    )


def first_stress():
    """Held between planes, and free of forces across, a body stays as it is; without the planes it does
    not."""
    for model, extra in (("elastic", ""), ("neo_hookean", ""), ("j2", ", yield_stress=1e5")):
        for sides in ("symmetry", "free"):
            text = (
                "&scene title='rest', end_time=0.1 /\n"
                + grid((6, 6, 6), 1.0, 0.0, ("'symmetry'," + f"'{sides}',") * 2 + "'roller','free'")
                + f"&material name='m', model='{model}', density=1000, young=1e6, poisson=0.3{extra} /\n"
                + "&body material='m', shape='box', lower=0,0,0, "
                f"upper={'6,6' if sides == 'symmetry' else '4,4'},4, "
                + "stress=5e4,3e4,0,0,0,0 /\n"
                + f"&output directory='{model}_{sides}' /\n"
            )
            run(text, 1)
            last = snapshots(f"{model}_{sides}")[-1].fields
            off = (last["stress"] - [5e4, 3e4, 0, 0, 0, 0]) / 5e4
            if sides == "symmetry":
                check(f"{model}: stress of a body that is held", off, 1e-9)
                check(f"{model}: its speed", last["velocity"], 1e-9)
            else:
                require(f"{model}: a body that is not held gives way", np.abs(off).max() > 0.1)
    # on levels: no force from the stress that was there at the edges' beginning (eq. time-levels)
    for effect in ("", "&anti_locking /\n"):
        text = (
            "&scene title='rest', end_time=0.3 /\n"
            + grid((16, 16, 16), 1.0, 0.0, "'symmetry'")
            + LAW
            + "&body material='m', shape='box', lower=0,0,0, upper=16,16,16, stress=5e4,3e4,0,0,0,0 /\n"
            + "&level lower=4,4,4, upper=12,12,12 /\n&level lower=6,6,6, upper=10,10,10 /\n"
            + f"{effect}&output directory='levels' /\n"
        )
        run(text, 1)
        last = snapshots("levels")[-1].fields
        what = f"three levels{', means over cells' if effect else ''}"
        check(f"{what}: stress at rest", (last["stress"] - [5e4, 3e4, 0, 0, 0, 0]) / 5e4, 1e-9)
        check(f"{what}: speed", last["velocity"], 1e-9)
    # neo-Hookean under a large stress in all components
    text = (
        "&scene title='rest', end_time=1e-6 /\n"
        + grid((6, 6, 6))
        + "&material name='m', model='neo_hookean', density=1000, young=1e6, poisson=0.3 /\n"
        + "&body material='m', shape='box', lower=1,1,1, upper=4,4,4, stress=5e5,-3e5,2e5,1e5,-2e5,3e5 "
        "/\n&output directory='large' /\n"
    )
    run(text, 1)
    off = snapshots("large")[-1].fields["stress"] / 5e5 - [1, -0.6, 0.4, 0.2, -0.4, 0.6]
    check("neo_hookean: a large first stress in all components, after a step", off, 1e-3)
    said = run(
        "&scene title='x', end_time=1 /\n"
        + grid((6, 6, 6))
        + "&material name='m', model='j2', density=1000, young=1e6, poisson=0.3, yield_stress=1e4 /\n"
        + "&body material='m', shape='box', lower=1,1,1, upper=4,4,4, stress=5e4,0,0,0,0,0 /\n",
        1,
        (2,),
    )
    require(
        "a stress beyond the yield stress is refused",
        "does not admit the initial stress=50000,0,0,0,0,0 Pa" in said,
    )


volumes()
pressures()
a_fifth()
warned()
lame()
first_stress()
finish()
