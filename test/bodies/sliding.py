"""A block on a deformable base, under gravity that is turned by an angle to the interface: it slides as (tan
angle - mu) g cos angle, or sticks. The same with the interface turned to the grid. The cells are 1 m."""

from meeting import *

FRICTION = 0.3


def block_on_base(
    name,
    slope,
    friction=FRICTION,
    steps=4000,
    domain="fixed",
    height=0.3,
    groups=True,
    way=0.0,
    damped=0.0,
    per_cell=8,
    ranks=1,
):
    """Slope: tangent of the angle. The base stands on a smooth rigid tool, `height` over a node plane, and
    between symmetry planes at its ends: it may not slide."""
    young, poisson = 1e9, 0.0
    angle = math.atan(slope)
    pull = 2e-4 * young / (DENSITY * 4)
    end = steps * 0.3 / BAR_WAVE
    length = 18 + math.ceil(way)
    return (
        Run(
            name,
            f"""&scene title='block on a base', end_time={end!r} /
&grid lower=0,0,-2, upper={length},8,9, cell_size=1, boundary='symmetry','symmetry','symmetry','free','free','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={young!r}, poisson={poisson!r} /
&body material='m', shape='box', lower=0,0,{height!r}, upper={length},5,{2 + height!r}, particles_per_cell={per_cell} {group(groups and 'base')} /
&body material='m', shape='box', lower=3.2,0,{2 + height!r}, upper=9.2,3,{5 + height!r}, particles_per_cell={per_cell} {group(groups and 'block')} /
&body_contact start='as_is', friction={friction!r} /
&tool name='floor', shape='flat', radius=60, tip=0,0,{height!r}, axis=0,0,1, times=0, speeds=0, penetration_factor=0.5 /
&gravity acceleration={pull * math.sin(angle)!r},0,{-pull * math.cos(angle)!r} /
{f"&damping kind='viscous', coefficient={damped!r} /" if damped else ""}
&output directory='OUT', every={end / 4!r}, history_every={end / 400!r} /
""".replace("&body_contact", "&body_contact" if groups else "! &body_contact"),
            ranks,
        ),
        pull,
        angle,
    )


def motion(run, body=2):
    """Times, place and velocity along the base of the middle of a body."""
    rows = []
    for path in sorted(run.directory.glob("particles_*.hdf")):
        one = Particles(path)
        own = one["body"] == body
        rows.append(
            (
                one.time,
                *(
                    np.average(one[what][own, 0], weights=one["mass"][own])
                    for what in ("position", "velocity")
                ),
            )
        )
    return np.array(rows).T


def slides(name, ratios, bounds, steps=2500, **kind):
    """Speed at the end over that of a block that nothing shakes: gravity comes on at once, and damping (rate
    c) stops the ringing and slows the block too, v = a (1 - exp(-c t))/c."""
    for ratio, bound in zip(ratios, bounds):
        slope = ratio * FRICTION
        rate = 40.0
        run, pull, angle = block_on_base(f"{name}_{ratio}", slope, steps=steps, damped=rate, **kind)
        time, place, speed = motion(run)
        exact = pull * (math.sin(angle) - FRICTION * math.cos(angle)) * (1 - np.exp(-rate * time)) / rate
        share = speed[-1] / exact[-1]
        heat = run.history("contact_base_block")["friction_heat"]
        work = FRICTION * pull * math.cos(angle) * DENSITY * 54 * (place[-1] - place[0])
        print(
            f"   {name}, tan {ratio} mu: speed over the exact {share:.4f}; way "
            f"{place[-1] - place[0]:.3f} cells; heat over friction's work {heat[-1] / work:.4f}, falls in "
            f"{(np.diff(heat) < 0).sum()} of {heat.size} rows",
            flush=True,
        )
        check(f"{name}, tan {ratio} mu: speed over the exact, off 1", share - 1, bound)


def sticks(name, ratio=0.9, steps=4000, **kind):
    run, pull, angle = block_on_base(name, ratio * FRICTION, steps=steps, damped=0.2 * BAR_WAVE, **kind)
    time, place, speed = motion(run)
    creep = (place[-1] - place[2]) / (time[-1] - time[2]) * (1000 * 0.3 / BAR_WAVE)
    print(f"   {name}: creep {creep:.2e} cells in 1000 steps")
    check(f"{name}: creep at {ratio} mu, cells in 1000 steps", creep, 1e-4)


def turned(name, angle, ratio, friction=FRICTION, steps=6000, domain="fixed", damped=None, shots=4):
    """A round block on a plane that is turned by an angle (rad) about y to the grid, both filled by the
    lattice of the grid; what is below the plane sticks to the sides of the grid. Gravity is turned on by tan
    = ratio mu."""
    normal, along = (
        np.array([math.sin(angle), 0, math.cos(angle)]),
        np.array([math.cos(angle), 0, -math.sin(angle)]),
    )
    slope = math.atan(ratio * friction)
    pull = 2e-4 * YOUNG / (DENSITY * 4)
    foot, end = np.array([7.0, 6.0, 5.0]), steps * 0.3 / BAR_WAVE
    rate = 0.2 * BAR_WAVE if damped is None else damped
    run = Run(
        name,
        f"""&scene title='turned', end_time={end!r} /
&grid lower=0,0,0, upper=14,12,13, cell_size=1, boundary='fixed','fixed','fixed','fixed','fixed','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0.3 /
&body name='base', material='m', shape='box', lower=0,0,0, upper=14,12,10 {group('base')} /
&cut body='base', shape='cylinder', center={numbers(foot)}, axis={numbers(normal)}, radius=40, height=30 /
&body material='m', shape='cylinder', center={numbers(foot - 0.5 * along)}, axis={numbers(normal)}, radius=3, height=3 {group('block')} /
&body_contact start='as_is', friction={friction!r} /
&gravity acceleration={numbers(pull * (math.sin(slope) * along - math.cos(slope) * normal))} /
&damping kind='viscous', coefficient={rate!r} /
&output directory='OUT', every={end / shots!r}, history_every={end / 400!r} /
""",
    )
    return run, normal, along, pull, slope, rate


def along_of(run, along):
    """Time, and place and velocity along the interface of the block's lowest layers over those of the base's
    highest below it: means over the same particles, for the base sways."""
    shots = [Particles(path) for path in sorted(run.directory.glob("particles_*.hdf"))]
    normal = np.array([-along[2], 0, along[0]])
    first = shots[0]
    height = first["position"] @ normal
    low, high = height[first["body"] == 2].min(), first["position"][first["body"] == 2]
    middle = high.mean(axis=0)
    away = first["position"] - middle
    near = (abs(height - low) < 0.9) & (np.linalg.norm(away - np.outer(away @ normal, normal), axis=1) < 2.5)
    chosen = [first.ids[near & (first["body"] == body)] for body in (1, 2)]
    rows = []
    for one in shots:
        order = np.argsort(one.ids)
        at = [order[np.searchsorted(one.ids[order], ids)] for ids in chosen]
        rows.append(
            (
                one.time,
                *(
                    np.mean(one[what][at[1]] @ along) - np.mean(one[what][at[0]] @ along)
                    for what in ("position", "velocity")
                ),
            )
        )
    return np.array(rows).T


def sticks_turned(name, angle, ratio, **kind):
    run, _, along, *_ = turned(name, angle, ratio, **kind)
    time, place, _ = along_of(run, along)
    creep = (place[-1] - place[-2]) / (time[-1] - time[-2]) * (1000 * 0.3 / BAR_WAVE)
    print(f"   {name}: turned by {angle} rad, {ratio} mu: creep {creep:.2e} cells in 1000 steps", flush=True)
    check(f"{name}: creep, cells in 1000 steps", creep, 1e-4)


def slides_turned(name, angle, ratio, bound, steps=2000, **kind):
    """Speed at the end over the exact one; and the force between the bodies, over the second half, lies in
    the interface by the coefficient of friction: what the gaps of two flat faces differ by, a block would
    have to climb."""
    run, normal, along, pull, slope, rate = turned(name, angle, ratio, damped=40.0, steps=steps, **kind)
    time, place, speed = along_of(run, along)
    exact = pull * (math.sin(slope) - FRICTION * math.cos(slope)) * (1 - np.exp(-rate * time)) / rate
    rows = run.history("contact_base_block")
    force = np.array([rows[f"force_{axis}"] for axis in "xyz"]).T[rows["time"].size // 2 :].sum(axis=0)
    print(
        f"   {name}: turned by {angle} rad, tan {ratio} mu: speed over the exact "
        f"{speed[-1] / exact[-1]:.4f}, way {place[-1] - place[0]:.3f}, "
        f"friction {-(force @ along) / (force @ normal):.5f}",
        flush=True,
    )
    check(f"{name}: speed over the exact, off 1", speed[-1] / exact[-1] - 1, bound)
    check(
        f"{name}: force along the interface over that across it, over the coefficient, off 1",
        -(force @ along) / (force @ normal) / FRICTION - 1,
        2e-3,
    )


CASES = {
    "turned_long": lambda: (
        [
            sticks_turned(f"stick_{domain}_{angle}_{ratio}", angle, ratio, domain=domain)
            for domain in ("fixed", "corners")
            for angle in (0.0, 0.2, 0.35, 0.55)
            for ratio in (0.5, 0.9)
        ],
        [
            slides_turned(f"slide_{angle}_{ratio}", angle, ratio, bound)
            for angle in (0.0, 0.2, 0.35, 0.55)
            for ratio, bound in ((1.2, 0.05), (1.5, 0.02), (2.0, 0.01), (3.0, 0.01))
        ],
    ),
    "turned": lambda: slides_turned("turned", 0.35, 3.0, 0.05, steps=500),
    "slides": lambda: slides("fixed", (2.0,), (0.02,), steps=500),
    "sticks": lambda: sticks("sticks", steps=800),
    "slides_long": lambda: [
        slides(
            f"{domain} {height}",
            (1.2, 1.5, 2.0, 3.0, 5.0),
            (0.05, 0.02, 0.01, 0.01, 0.01),
            domain=domain,
            height=height,
            way=14,
        )
        for domain, height in (("fixed", 0.3), ("corners", 0.3), ("fixed", 0.0))
    ],
    # of cubes, one a cell, the work of gravity by grid and by particles drifts apart until the guard ends the
    # run: with and without groups
    "sticks_long": lambda: [
        sticks(
            f"{domain}, {height} of a cell, {per_cell} a cell",
            domain=domain,
            height=height,
            per_cell=per_cell,
        )
        for domain, several in (("fixed", (8,)), ("corners", (8, 1)), ("stretch", (8,)))
        for height in (0.0, 0.3, 0.71)
        for per_cell in several
    ],
}
if __name__ == "__main__":
    main(CASES)
