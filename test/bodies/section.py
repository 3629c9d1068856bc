"""Bodies of contact groups in scenes that are given by a section (theory.md, Sections): areas of rings, normals
in the plane. usage: section.py CASE... (in an empty directory; GIMP3D is the program)"""

import csv

from meeting import *

from sphere import figures

GRID = """&grid geometry='{geometry}', lower={lower}, upper={upper}, cell_size={cell!r},
      boundary={boundary} /
"""


def sliding(name, geometry, more=""):
    """A block slides over another one and is pressed onto it; in plane strain, and as a slice of 3D."""
    return Run(
        name,
        "&scene title='sliding', end_time=0.05 /\n"
        + GRID.format(
            geometry=geometry,
            lower="0,0,0",
            upper="16,1,14",
            cell=1.0,
            boundary="'free','free','symmetry','symmetry','fixed','free'",
        )
        + """&time domain='corners' /
&material name='m', model='neo_hookean', density=1000, young=1e7, poisson=0.3 /
&body material='m', shape='box', lower=1,0,0, upper=14,1,4.5, contact_group='a' /
&body material='m', shape='box', lower=4,0,4.6, upper=9,1,9.6, contact_group='b', velocity=6,0,-10 /
&body_contact friction=0.3 /
&output directory='OUT', formats='none', history_every=1e-30 /
"""
        + more,
    )


def plane():
    """Plane strain is a slice of 3D, but that this sees surfaces in the mean over neighbours across it too:
    forces, heat and area over time. An element at the corner meets the other body a step sooner in 3D. With
    the compliance below a cell that takes part of the load over at once: momentum is compared."""
    kinds = ("3d", "plane_strain")
    rows = [sliding(f"default_{g}", g).history("contact_a_b") for g in kinds]
    for column in ("force_x", "force_z"):
        given = [np.trapezoid(one[column], one["time"]) for one in rows]
        check(f"sliding: momentum by {column} beside a slice of 3D", given[1] / given[0] - 1, 5e-3)
    rows = [sliding(f"sliding_{g}", g, "&contact subcell=0 /\n").history("contact_a_b") for g in kinds]
    for column, bound in (
        ("force_x", 2e-3),
        ("force_z", 2e-3),
        ("friction_heat", 5e-3),
        ("contact_area", 0.1),
    ):
        size = np.abs(rows[0][column]).max()
        both = [np.interp(rows[0]["time"], one["time"], one[column]) for one in rows]
        check(f"sliding: {column} beside a slice of 3D", np.abs(both[1] - both[0]).max() / size, bound)
    require("sliding: it rubs", rows[1]["friction_heat"][-1] > 0)


def reference(speed):
    """What the finest finite elements say: peak force (in E R^2), duration (R/c) and restitution."""
    with open(ROOT / "test/references/impact/sphere.csv", newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    return [row for row in rows if row["speed"] == speed][-1]


def balls(name, cells, domain="fixed", groups=True, ranks=1, speed=0.01, arguments=(), more=""):
    """Two equal balls (R = 1 m, `cells` cells) that fly at each other, each at `speed` (bar waves)."""
    size, one = 1 / cells, speed * BAR_WAVE
    low, high = 3 * size + 1, 3.3 * size + 3
    end = 0.15 * size / one + 1.2 * 13.0 * (0.01 / speed) ** 0.2 / BAR_WAVE
    return Run(
        name,
        f"&scene title='two balls', end_time={end!r} /\n"
        + GRID.format(
            geometry="axisymmetric",
            lower="0,0",
            upper=numbers((cells + 3) * size, math.ceil((high + 1) * cells + 3) * size),
            cell=size,
            boundary="'symmetry','free','free','free'",
        )
        + f"""&time domain='{domain}' /
&material name='m', model='neo_hookean', density={DENSITY}, young={YOUNG}, poisson=0.3 /
&body material='m', shape='sphere', center=0,0,{low!r}, radius=1, velocity=0,0,{one!r} {group(groups and "a")} /
&body material='m', shape='sphere', center=0,0,{high!r}, radius=1, velocity=0,0,{-one!r} {group(groups and "b")} /
{more}&output directory='OUT', history_every=1e-30 /
""",
        ranks,
        arguments,
    )


def rebound(run, speed):
    """Speed at which the centres part over that at which they came."""
    last = run.last()
    upward = [
        np.average(last["velocity"][last["body"] == body, 2], weights=last["mass"][last["body"] == body])
        for body in (1, 2)
    ]
    return (upward[1] - upward[0]) / (2 * speed * BAR_WAVE)


def against_reference(name, cells, bound, lost, speed=0.01, **kind):
    run = balls(name, cells, speed=speed, **kind)
    time, force = run.force()
    exact = reference(speed)
    peak, duration = figures(time, -force[:, 2])
    peak, duration = peak / YOUNG / exact["peak_force"], duration * BAR_WAVE / exact["duration"]
    restitution = rebound(run, speed) / exact["restitution"]
    rows = run.energy
    # a row has velocities of half a step before its places: the mean of it and the next is at their time
    kinetic = 0.5 * (rows["kinetic"][:-1] + rows["kinetic"][1:])
    kept = (kinetic + rows["strain"][:-1]) / rows["kinetic"][0]
    momentum = np.abs(rows["momentum_z"]).max() / (rows["mass"][0] * speed * BAR_WAVE)
    print(
        f"   {name}: over finite elements: peak {peak:.4f}, duration {duration:.4f}, restitution "
        f"{restitution:.4f}; energy at the end {kept[-1]:.4f}, highest {kept.max():.5f}",
        flush=True,
    )
    check(f"{name}: peak force over that of finite elements, off 1", peak - 1, bound)
    check(f"{name}: duration over that of finite elements, off 1", duration - 1, bound)
    check(f"{name}: restitution over that of finite elements, off 1", restitution - 1, lost)
    check(f"{name}: energy above its start, relative", max(0, kept.max() - 1), 1e-4)
    check(f"{name}: momentum along the axis, of one ball's", momentum, 1e-12)


def two_balls():
    against_reference("balls", 10, 0.03, 0.03)
    require(
        "control: in one velocity field the balls do not part",
        rebound(balls("one_field", 5, groups=False, speed=0.02), 0.02) < 0.5,
    )


def two_balls_long():
    for cells in (10, 20, 40):
        for domain in ("fixed", "stretch", "corners"):
            against_reference(f"balls_{cells}_{domain}", cells, 0.03, 0.03, domain=domain)
    for speed in (0.005, 0.02):  # those of the finite elements
        against_reference(f"balls_speed_{speed}", 20, 0.03, 0.03, speed=speed)


def goes_on():
    """On two ranks the same to the contact solver's tolerance; after a restart to the bit."""
    checkpoint = "&checkpoint every_steps=60 /\n"
    one = balls("one", 5, speed=0.05, more=checkpoint)
    two = balls("two", 5, speed=0.05, ranks=2)
    size = np.abs(one.force()[1]).max()
    check("two ranks: force", np.abs(two.force()[1] - one.force()[1]).max() / size, 1e-6)
    shutil.copytree("one", "again")
    checkpoints = sorted(Path("again").glob("checkpoint_*.h5"))
    checkpoints[-1].unlink()
    done = subprocess.run(
        [os.environ["GIMP3D"], "--restart", "again"], capture_output=True, text=True, timeout=120
    )
    require("restart: it goes on", done.returncode == 0 and checkpoints[-2].name in done.stdout)
    for name in ("energy.dat", "contact_a_b.dat"):
        require(
            f"restart: {name} to the bit", Path("one", name).read_bytes() == Path("again", name).read_bytes()
        )


def rings(name, cell, interference, explicit=False, domain="corners"):
    """Pressure between a ring and a hub (m: how much larger its radius is), over Lame's of 1 um or that."""
    young, nu, radius, fits = 210e9, 0.3, 20e-3, interference / 2
    end = 3e-4 if explicit else 1.0
    fit = f", start='as_is', press_fit={0.5 * end}" if interference > 0 else ""
    run = Run(
        name,
        f"&scene title='{name}', end_time={end} /\n"
        + GRID.format(
            geometry="axisymmetric",
            lower="0,0",
            upper=numbers(32e-3, 2 * cell),
            cell=cell,
            boundary="'symmetry','free','symmetry','symmetry'",
        )
        + f"""&time domain='{domain}' /
&material name='steel', model='elastic', density=7800, young={young}, poisson={nu} /
&body name='a', material='steel', shape='cylinder', center=0,0,0, radius={radius + fits!r}, height={2 * cell!r}, contact_group='a' /
&cut body='a', shape='cylinder', center=0,0,-5e-3, radius=10e-3, height=15e-3 /
&body name='b', material='steel', shape='cylinder', center=0,0,0, radius=30e-3, height={2 * cell!r}, contact_group='b' /
&cut body='b', shape='cylinder', center=0,0,-5e-3, radius={radius - fits!r}, height=15e-3 /
&body_contact groups='a','b'{fit} /
"""
        + (
            "&damping kind='viscous', coefficient=1e5 /\n"
            if explicit
            else "&quasi_static step=0.25, max_step=0.25 /\n"
        )
        + f"&output directory='OUT', history_every={end / 100} /\n",
    )
    lame = max(abs(interference), 1e-6) * young / (1 - nu**2) / (radius * (1300 / 500 + 500 / 300))
    time, force = run.force()
    return -force[time > 0.85 * end, 0].mean() / (2 * math.pi * radius * 2 * cell) / lame


def press_fits():
    """Lame; where nothing acts, nothing."""
    for mm, bound in ((2, 0.01), (1, 0.005)):
        off = rings(f"fit_{mm}", mm * 1e-3, 2.5e-6) - 1
        print(f"   press fit of 2.5 um, cells of {mm} mm: pressure {100 * off:+.2f} % off Lame's")
        check(f"press fit, cells of {mm} mm: pressure over Lame's, off 1", off, bound)
    check("rings that fit, pressure over that of 1 um", rings("none", 2e-3, 0.0), 1e-6)
    check("control: rings 1 um apart do not press", rings("apart", 2e-3, -1e-6), 0.0)


def press_fits_long():
    for um in (2.5, 25):
        for mm in (2, 1, 0.5):
            for domain in ("stretch", "corners"):
                for explicit in (False, True):
                    name = f"fit_{um}_{mm}_{domain}_{'explicit' if explicit else 'static'}"
                    off = rings(name, mm * 1e-3, um * 1e-6, explicit=explicit, domain=domain) - 1
                    print(f"   {name}: pressure {100 * off:+.2f} % off Lame's", flush=True)
                    # two cells across: boxes in explicit steps are 1.1 % off
                    check(f"{name}: pressure over Lame's, off 1", off, 0.012 if mm == 2 else 0.01)


def socket():
    """A ball in a socket of its radius, and a cylinder in its hole, four cells a radius, in a quasi-static step:
    where nothing acts they press by nothing."""
    for geometry, shape in (
        ("axisymmetric", "shape='sphere', center=0,0,0"),
        ("plane_strain", "shape='cylinder', axis=0,1,0, center=0,0,0, height=2e-3"),
    ):
        fit_of(geometry, shape)


def fit_of(geometry, shape):
    radius = 8e-3
    run = Run(
        f"socket_{geometry}",
        "&scene title='a body in its socket', end_time=0.5 /\n"
        + GRID.format(
            geometry=geometry,
            lower="0,0",
            upper="16e-3,16e-3",
            cell=2e-3,
            boundary="'symmetry','free','symmetry','free'",
        )
        + f"""&material name='steel', model='elastic', density=7800, young=210e9, poisson=0.3 /
&body name='a', material='steel', {shape}, radius={radius}, contact_group='a' /
&body name='b', material='steel', {shape}, radius=14e-3, contact_group='b' /
&cut body='b', {shape}, radius={radius} /
&quasi_static step=0.25, max_step=0.25 /
&output directory='OUT', history_every=0.1, formats='none' /
""",
    )
    time, force = run.force()
    area = math.pi * radius**2 if geometry == "axisymmetric" else radius
    pressure = np.abs(force[time > 0.4, 2]).mean() / area
    check(f"{geometry}, a body in a socket of its radius: pressure over 1e-6 E", pressure / 2.1e5, 1e-3)


LEVELLED = """&scene title='ball on a plate', end_time=1 /
&grid geometry='{geometry}', lower=0,0, upper=10e-3,21e-3, cell_size=1e-3, boundary='symmetry','free','roller','free' /
&level lower=0,0,6e-3, upper={wide},0,14e-3 /
&level lower=0,0,8e-3, upper=2e-3,0,12e-3 /
&material name='steel', model='elastic', density=7800, young=210e9, poisson=0.3 /
&body material='steel', shape='box', lower=0,0,0, upper=9e-3,1e-3,10e-3, contact_group='a' /
&body name='ball', material='steel', {ball}, radius=5e-3, contact_group='b' /
&cut body='ball', shape='box', lower=0,0,15e-3, upper=9e-3,1,21e-3 /
&pressure lower=0,0,15e-3, upper=4e-3,1e-3,15e-3, times=0,1, values=0,150e6 /
&quasi_static step=0.125, max_step=0.125 /
&output directory='OUT', formats='none', history_every=0.1 /
"""


def level_edge():
    """Where the surface of a pressed body crosses the edge of a level, all of the load gets to the other body:
    the force is that beside an edge that clears the body."""
    for geometry, ball in (
        ("axisymmetric", "shape='sphere', center=0,0,15e-3"),
        ("plane_strain", "shape='cylinder', axis=0,1,0, height=1, center=0,0,15e-3"),
    ):
        forces = []
        for wide in (4e-3, 6e-3):
            text = LEVELLED.format(geometry=geometry, ball=ball, wide=wide)
            time, force = Run(f"edge_{geometry}_{wide}", text).force()
            forces.append(np.interp(np.linspace(0.3, 1, 8), time, -force[:, 2]))
        off = np.abs(forces[0] / forces[1] - 1).max()
        print(f"   {geometry}: force beside that with a wider level, off 1: {off:.1e}")
        check(f"{geometry}: the surface crosses a level's edge: force, off 1", off, 1e-4)


CASES = {
    "plane": plane,
    "two_balls": two_balls,
    "goes_on": goes_on,
    "press_fits": press_fits,
    "socket": socket,
    "level_edge": level_edge,
    "two_balls_long": two_balls_long,
    "press_fits_long": press_fits_long,
}
if __name__ == "__main__":
    main(CASES)
