"""Spheres fly about in a box of six deformable plates, free in space, for very long: energy never above that
of the start."""

from meeting import *


def box(name, steps, friction=0.0, radius=2.5, domain="fixed", groups=True):
    cavity, wall = 8, 1
    low, high = 2.0, 2.0 + cavity + 2 * wall
    inner, outer = low + wall, high - wall
    plates = []
    for axis in range(3):
        for side in range(2):
            begin, end = [low] * 3, [high] * 3
            for other in range(axis):  # plates of axes before this one take the edges
                begin[other], end[other] = inner, outer
            begin[axis], end[axis] = (low, inner) if side == 0 else (outer, high)
            plates.append(
                f"&body material='m', shape='box', lower={numbers(begin)}, upper={numbers(end)} "
                f"{group(groups and 'box')} /\n"
            )
    time = steps * 0.3 / BAR_WAVE
    run = Run(
        name,
        f"""&scene title='spheres in a box', end_time={time!r} /
&grid lower=-12,-12,-12, upper=26,26,26, cell_size=1 /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0.3 /
{"".join(plates)}&body material='m', shape='sphere', center=5.6,5.7,5.6, radius={radius!r}, velocity=10,8,6 {group(groups and 'one')} /
&body material='m', shape='sphere', center=8.3,8.2,8.4, radius=1.5, velocity=-46.3,-37,-27.8 {group(groups and 'two')} /
{f"&body_contact friction={friction!r} /" if groups else ""}
&output directory='OUT', formats='none', history_every={time / 2000!r} /
""",
    )
    rows = run.energy
    energy = rows["kinetic"] + rows["strain"]
    momentum = np.stack([rows[f"momentum_{axis}"] for axis in "xyz"], axis=1)
    scale = math.sqrt(2 * rows["mass"][0] * rows["kinetic"][0])
    touched = [
        name
        for name in ("box_one", "box_two", "one_two")
        if groups and abs(run.force(*name.split("_"))[1]).max() > 0
    ]
    print(
        f"   {name}: energy over the first: highest {energy.max() / energy[0]:.5f}, at the end "
        f"{energy[-1] / energy[0]:.3f}; pairs that met in the rows of histories: {touched}",
        flush=True,
    )
    check(
        f"{name}: energy above that of the start, relative",
        max(0, energy.max() / energy[0] - 1),
        1e-4 if groups else 1,
    )
    check(f"{name}: change of momentum, relative", (momentum - momentum[0]) / scale, 1e-11)


CASES = {
    "box": lambda: box("box", 150),
    "box_long": lambda: [
        box("box_smooth", 20000),
        box("box_rough", 20000, friction=0.3),
        box("box_corners", 5000, friction=0.3, domain="corners"),
    ],
}
if __name__ == "__main__":
    main(CASES)
