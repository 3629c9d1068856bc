"""The same contact on 1, 2 and 4 ranks, to the solver's tolerance; after a restart in the middle; on nested
levels, which carry contact on the finest one alone."""

from impact import *


def ranks(friction, name, numbers_of_ranks=(1, 2, 4), **kind):
    runs = [oblique(f"{name}_{n}", ranks=n, friction=friction, **kind) for n in numbers_of_ranks]
    time, first = runs[0].force("block", "ball")
    largest = abs(first).max()
    for n, run in zip(numbers_of_ranks[1:], runs[1:]):
        _, force = run.force("block", "ball")
        check(f"{name}: {n} ranks: force off that on 1, of the largest", (force - first) / largest, 1e-5)
        places = [(lambda one: one["position"][np.argsort(one.ids)])(one.last()) for one in (runs[0], run)]
        check(f"{name}: {n} ranks: places off those on 1, cells", places[1] - places[0], 1e-6)
        check(
            f"{name}: {n} ranks: change of momentum, relative",
            [
                (run.energy[f"momentum_{axis}"] - run.energy[f"momentum_{axis}"][0])
                / math.sqrt(2 * run.energy["mass"][0] * run.energy["kinetic"][0])
                for axis in "xyz"
            ],
            1e-12,
        )


def restart(name, radius=3.0, friction=0.3):
    """A run that ends in the middle of the contact and goes on gives the same bits as one that does not."""
    whole = oblique(f"{name}_whole", radius=radius, friction=friction)
    steps = whole.energy.rows // 2
    part = oblique(
        f"{name}_part", radius=radius, friction=friction, checkpoint=f"&checkpoint every_steps={steps} /\n"
    )
    found = sorted(part.directory.glob("checkpoint*"))
    require(f"{name}: a checkpoint in the middle, not {found}", bool(found))
    again = subprocess.run(
        [os.environ["GIMP3D"], "--restart", str(part.directory)], capture_output=True, text=True
    )
    require(f"{name}: goes on: {again.stdout[-300:]}{again.stderr[-300:]}", again.returncode == 0)
    for file in ("contact_block_ball.dat", "energy.dat"):
        require(
            f"{name}: {file} has the same bits",
            (whole.directory / file).read_bytes() == (part.directory / file).read_bytes(),
        )


def on_levels(name, cells=5, speed=0.02, inside=True, allowed=0, domain="fixed"):
    """Two spheres head on, the place of contact in a finer level."""
    size = 1 / cells
    gap = 0.3 * size
    low = 3 * size + 1
    middle = low + 1 + gap / 2
    velocity = speed * BAR_WAVE
    end = 0.5 * gap / velocity + 1.2 * 13.0 * (0.01 / speed) ** 0.2 / BAR_WAVE
    height = math.ceil((low + 2 + gap + 1) * cells + 3)
    k = round(middle * cells)
    begin, last = (k - 6, k + 6) if inside else (2, k - 3)
    return Run(
        name,
        f"""&scene title='two spheres on levels', end_time={end!r} /
&grid lower=0,0,0, upper={numbers(*2 * [(cells + 3) * size], height * size)}, cell_size={size!r},
      boundary='symmetry','free','symmetry','free','free','free' /
&time domain='{domain}' /
&level lower=0,0,{begin * size!r}, upper={numbers((cells + 3) * size, (cells + 3) * size)},{last * size!r} /
&material name='m', model='neo_hookean', density={DENSITY}, young={YOUNG}, poisson=0.3 /
&body material='m', shape='sphere', center=0,0,{low!r}, radius=1, velocity=0,0,{velocity!r}, particles_per_cell=8 {group('a')} /
&body material='m', shape='sphere', center=0,0,{low + 2 + gap!r}, radius=1, velocity=0,0,{-velocity!r}, particles_per_cell=8 {group('b')} /
&output directory='OUT', history_every=1e-30 /
""",
        allowed=allowed,
    )


def levels(name, cells, speed=0.02, bound=0.03, **kind):
    run = on_levels(name, cells, speed, **kind)
    time, force = run.force()
    exact = reference(speed)
    peak, duration = figures(time, -4 * force[:, 2])
    peak, duration = peak / YOUNG / exact["peak_force"], duration * BAR_WAVE / exact["duration"]
    energy = energy_of(run)
    print(
        f"   {name}: over finite elements: peak force {peak:.4f}, duration {duration:.4f}; restitution "
        f"{rebound(run, speed):.4f}; energy at the end {energy[-1]:.4f}, highest {energy.max():.5f}",
        flush=True,
    )
    check(f"{name}: peak force over that of finite elements, off 1", peak - 1, bound)
    check(f"{name}: duration over that of finite elements, off 1", duration - 1, bound)


def refused(name):
    """Contact outside the finest level ends the run with a sentence that names the level's bounds."""
    run = on_levels(name, 5, inside=False, allowed=3)
    sentence = [line for line in run.log.splitlines() if line.startswith("gimp3d:")][-1]
    print("   " + sentence)
    require(
        "the sentence says what touches, on which level, what is allowed",
        all(word in sentence for word in ("touches", "level 1", "allowed")),
    )


CASES = {
    "ranks": lambda: ranks(0.3, "ranks", (1, 2), radius=2.5, end=0.5),
    "ranks_long": lambda: (
        ranks(0.3, "rough"),
        ranks(0.0, "smooth"),
        ranks(0.3, "corners", domain="corners"),
    ),
    "restart": lambda: restart("restart", radius=2.5),
    "refused": lambda: refused("refused"),
    "levels_long": lambda: (
        levels("levels_5", 5),
        levels("levels_5_slow", 5, 0.01),
        levels("levels_5_corners", 5, domain="corners"),
    ),
}
if __name__ == "__main__":
    main(CASES)
