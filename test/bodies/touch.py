"""At which gap bodies feel each other: where the first force acts, and where a hundredth of the momentum of
their approach is gone, beside Hertz's approach. Lattice-filled spheres and blocks, on any place of the grid,
in any direction. The cells are 1 m."""

from meeting import *

SLOW = 0.01 * BAR_WAVE  # of both together: m/s


def hertz(masses, radii):
    """How far two spheres come together (m) until a hundredth of their momentum is gone, by Hertz's law;
    nothing where a face is flat on a face. A radius may be infinite."""
    curvature = sum(1 / radius for radius in radii)
    if curvature == 0:
        return 0.0
    stiffness = 4 / 3 * YOUNG / (2 * (1 - 0.3**2)) / math.sqrt(curvature)
    return (2.5 * 0.01 * masses[0] * masses[1] / sum(masses) * SLOW**2 / stiffness) ** 0.4


def told(what, gaps, early=0.0):
    """The gaps of runs; `early`: how far Hertz lets the bodies come together."""
    first, felt = np.array(gaps).T
    print(
        f"   {what}: first force from {first.min():+.4f} to {first.max():+.4f} cells, 1 % of the momentum "
        f"from {felt.min():+.4f} to "
        f"{felt.max():+.4f}, rms {np.sqrt(np.mean(felt**2)):.4f}, by Hertz {-early:+.4f}, {len(gaps)} runs"
    )
    check(f"{what}: gap of the first force, cells", first, 0.05)
    check(f"{what}: gap where 1 % of the momentum is gone off Hertz's, cells", felt + early, 0.05)


def approach(name, bodies, direction, gap, groups=True, size=(24, 24, 32), domain="fixed"):
    """The gap (m) at which a hundredth of the momentum is gone, of two bodies that close at SLOW. `bodies`:
    shapes, masses."""
    velocity = 0.5 * SLOW * np.array(direction)
    end = (gap + 0.25) / SLOW if groups else gap / SLOW
    text = "".join(
        f"&body material='m', {shape}, velocity={numbers(side * velocity)}{group(which) if groups else ''} "
        "/\n"
        for shape, side, which in zip(bodies, (1, -1), "ab")
    )
    run = Run(
        name,
        f"""&scene title='first touch', end_time={end!r} /
&grid lower=0,0,0, upper={numbers(size)}, cell_size=1 /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0.3 /
{text}&output directory='OUT', formats='none' /
""",
    )
    return run, end


def gap_at_touch(run, direction, gap, masses):
    time, force = run.force()
    given = impulse(time, -force @ np.array(direction))
    require(f"{run.directory}: the bodies touch", given[-1] > 0)
    reduced = masses[0] * masses[1] / sum(masses)
    return gap - SLOW * np.array([time[np.argmax(given > 0)], np.interp(0.01 * reduced * SLOW, given, time)])


def sphere(center, radius):
    return (
        f"shape='sphere', center={numbers(center)}, radius={radius!r}",
        DENSITY * 4 / 3 * math.pi * radius**3,
    )


def box(lower, edges):
    return f"shape='box', lower={numbers(lower)}, upper={numbers(np.add(lower, edges))}", DENSITY * float(
        np.prod(edges)
    )


def random_direction(random, least=0.0):
    """A unit vector, each component at least so large."""
    while True:
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        if abs(direction).min() >= least:
            return direction


def spheres(count, seed, radius=6.0, domain="fixed"):
    """Two spheres of R = 6 cells at random places, in random directions."""
    random = np.random.default_rng(seed)
    gaps = []
    for n in range(count):
        direction, gap = random_direction(random), 0.3
        middle = 17.0 + random.random(3)
        half = (radius + 0.5 * gap) * direction
        shapes = [sphere(middle - half, radius), sphere(middle + half, radius)]
        run, _ = approach(
            f"spheres_{n}", [one[0] for one in shapes], direction, gap, size=(36, 36, 36), domain=domain
        )
        gaps.append(gap_at_touch(run, direction, gap, [one[1] for one in shapes]))
    told(f"two spheres, {domain}", gaps, hertz([one[1] for one in shapes], (radius, radius)))


def on_block(count, seed, radius=6.0, domain="fixed"):
    """A sphere on the upper face of a block, at random places over it."""
    random = np.random.default_rng(seed)
    gaps = []
    for n in range(count):
        gap = 0.3
        lower = np.array([3.0, 3.0, 2.0]) + random.random(3)
        shapes = [
            box(lower, (14, 14, 6)),
            sphere(lower + (7, 7, 6 + gap + radius) + np.append(random.random(2) - 0.5, 0), radius),
        ]
        run, _ = approach(
            f"on_block_{n}", [one[0] for one in shapes], (0, 0, 1), gap, size=(22, 22, 26), domain=domain
        )
        gaps.append(gap_at_touch(run, (0, 0, 1), gap, [one[1] for one in shapes]))
    told(f"a sphere and a block, {domain}", gaps, hertz([one[1] for one in shapes], (radius, math.inf)))


def blocks(count, seed, domain="fixed"):
    """Two blocks, face to face."""
    random = np.random.default_rng(seed)
    gaps = []
    for n in range(count):
        gap = 0.3
        lower = np.array([3.0, 3.0, 2.0]) + random.random(3)
        shapes = [box(lower, (8, 8, 5)), box(lower + (*(4 * random.random(2) - 2), 5 + gap), (7, 7, 6))]
        run, _ = approach(
            f"blocks_{n}", [one[0] for one in shapes], (0, 0, 1), gap, size=(18, 18, 17), domain=domain
        )
        gaps.append(gap_at_touch(run, (0, 0, 1), gap, [one[1] for one in shapes]))
    told(f"two blocks, {domain}", gaps)


def one_field():
    """Control: bodies of one velocity field feel each other from more than a cell away."""
    shapes = [box((3.2, 3.4, 2.6), (8, 8, 5)), box((3.7, 3.4, 9.1), (7, 7, 6))]
    run, end = approach(
        "one_field", [one[0] for one in shapes], (0, 0, 1), 1.5, groups=False, size=(18, 18, 18)
    )
    rows = run.energy
    lost = 1 - rows["kinetic"][-1] / rows["kinetic"][0]
    print(f"   one field: at the gap's end {lost:.1%} of the kinetic energy is gone")
    require("control: in one velocity field blocks are felt before they touch", lost > 0.02)


CASES = {
    "spheres": lambda: spheres(2, 1),
    "on_block": lambda: on_block(1, 2),
    "blocks": lambda: blocks(2, 3),
    "one_field": one_field,
    "spheres_long": lambda: spheres(12, 11),
    "on_block_long": lambda: on_block(6, 12),
    "blocks_long": lambda: blocks(6, 13),
    "corners": lambda: (
        spheres(3, 21, domain="corners"),
        on_block(2, 22, domain="corners"),
        blocks(2, 23, domain="corners"),
    ),
}
if __name__ == "__main__":
    main(CASES)
