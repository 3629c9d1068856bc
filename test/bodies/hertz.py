"""A cylinder (plane strain) pressed by its own weight on an elastic plate, against Hertz: contact half-width
by the second moment of the forces, stress in the layers of particles below the surface. The cells are 1 m."""

from meeting import *

POISSON = 0.3
STIFFNESS = YOUNG / (2 * (1 - POISSON**2))  # of two equal bodies: E*


def below(y, z, half):
    """Stress (zz over p0) below a line contact of half-width `half` (Johnson, Contact Mechanics, eq.
    4.49)."""
    first = half**2 - y**2 + z**2
    root = np.sqrt(first**2 + 4 * y**2 * z**2)
    m, n = np.sqrt((root + first) / 2), np.sqrt(np.maximum(root - first, 0) / 2)
    return -m / half * (1 - (z**2 + n**2) / (m**2 + n**2))


def cylinder(
    name,
    half=3.0,
    radius=24.0,
    offset=0.41,
    domain="fixed",
    groups=True,
    steps=3500,
    per_cell=8,
    static=False,
    tolerance=1e-6,
    more="",
):
    """Half of a cylinder on a plate 0.8 R thick, its axis along z, pressed along -x by gravity; the plate
    lies on a smooth rigid tool `offset` over a node plane. `static`: in quasi-static steps, as many as
    `steps`, with its weight coming on."""
    thick, wide = round(0.8 * radius), round(1.5 * radius)
    load = math.pi * STIFFNESS * half**2 / (4 * radius)  # N/m
    pull = load / (DENSITY * math.pi * radius**2)
    pressure = 2 * load / (math.pi * half)
    end = steps * 0.3 / BAR_WAVE
    top = offset + thick
    rate = 2 * 0.9 * math.sqrt(0.3 * YOUNG / (DENSITY * math.pi * radius**2))
    comes_to_rest = f"&damping kind='viscous', coefficient={rate!r} /"
    if static:
        end = 1.0
        comes_to_rest = (
            f"&quasi_static tolerance={tolerance!r}, step={end / steps!r}, max_step={end / steps!r}, "
            f"ramp={end!r} /"
        )
    run = Run(
        name,
        f"""&scene title='cylinder on a plate', end_time={end!r} /
&grid lower=-2,0,0, upper={math.ceil(top + 2 * radius) + 3},{wide + 3},1, cell_size=1,
      boundary='free','free','symmetry','free','symmetry','symmetry' /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson={POISSON} /
&body material='m', shape='box', lower={offset!r},0,0, upper={top!r},{wide},1, particles_per_cell={per_cell} {group(groups and 'plate')} /
&body material='m', shape='cylinder', center={top + radius!r},0,0, radius={radius!r}, height=1, particles_per_cell={per_cell}
      {group(groups and 'cylinder')} /
&tool name='base', shape='flat', radius=99, tip={offset!r},1,0.5, axis=1,0,0, times=0, speeds=0 /
&gravity acceleration={-pull!r},0,0 /
{comes_to_rest}
{more}
&output directory='OUT' /
""",
    )
    last = run.last()
    weight = last["mass"][last["body"] == 2].sum() * pull  # of the lattice
    share = abs(run.force("plate", "cylinder")[1][-1, 0]) / weight if groups else math.nan
    half *= math.sqrt(weight / (load / 2))
    pressure *= math.sqrt(weight / (load / 2))
    force = last["contact_pressure"] * last["volume"] ** (2 / 3)
    near = (force > 0) & (last["position"][:, 0] > offset + 0.5 * thick)
    width = (
        2
        * math.sqrt(np.sum(force[near] * last["position"][near, 1] ** 2) / max(force[near].sum(), 1e-30))
        / half
    )
    edge = 0.5 if per_cell == 8 else 1.0
    # the layer in which a particle began: plates are filled row by row
    plate = last["body"] == 1
    order = np.round((last["position"][plate, 1] - edge / 2) / edge)
    off = []
    for layer in range(4):
        errors = []
        for column in np.unique(order):
            row = np.flatnonzero(plate)[order == column]
            if (column + 0.5) * edge > 2 * half:
                continue
            row = row[last["position"][row, 2] < edge]
            row = row[np.argsort(-last["position"][row, 0])]
            p = row[layer]
            exact = below(last["position"][p, 1], (layer + 0.5) * edge, half)
            errors.append(last["stress"][p, 0] / pressure - exact)
        off.append(math.sqrt(np.mean(np.square(errors))))
    # single pressures of the plate beside Hertz's, in their mean
    top = near & plate & (np.abs(last["position"][:, 1]) < 0.8 * half)
    single = last["contact_pressure"][top] / np.sqrt(1 - (last["position"][top, 1] / half) ** 2)
    rough = single.std() / max(single.mean(), 1e-30)
    speed = math.sqrt(2 * run.energy["kinetic"][-1] / run.energy["mass"][-1]) / BAR_WAVE
    print(
        f"   {name}: load over the weight {share:.5f}, half-width over Hertz's {width:.3f}, stress of layers "
        f"1 to 4 off by {', '.join(f'{one:.3f}' for one in off)} p0; single pressures scatter by "
        f"{100 * rough:.0f} %; speed {speed:.1e} c",
        flush=True,
    )
    return share, width, off, rough


def judged(name, narrow=0.05, scatter=None, **kind):
    share, width, off, rough = cylinder(name, **kind)
    if scatter:
        check(f"{name}: single pressures about Hertz's, of their mean", rough, scatter)
    check(f"{name}: load over the weight, off 1", share - 1, 1e-4)
    check(f"{name}: half-width over Hertz's, off 1", width - 1, narrow)
    # an interface that crosses a node plane: the difference of two layers of a cell is a mode that nodes do
    # not see
    bound = 0.08 if 0.1 <= kind.get("offset", 0.41) <= 0.25 else 0.05
    check(f"{name}: stress of layers 2 to 4 off Hertz's, in p0", np.array(off[1:]), bound)


CASES = {
    # 1.5 cells are three particles
    "cylinder": lambda: judged("cylinder", 0.1, 0.15, half=1.5, radius=12.0, steps=1600),
    "without": lambda: require(
        "control: without the compliance below a cell the half-width is more than 12 % off",
        cylinder("without", half=1.5, radius=12.0, steps=1600, more="&contact subcell=0 /")[1] < 0.88,
    ),
    "one_field": lambda: require(
        "control: in one field the layers are off by more than 0.2 p0",
        max(cylinder("one_field", half=1.5, radius=12.0, steps=1600, groups=False)[2][1:]) > 0.2,
    ),
    "cylinder_long": lambda: [
        judged(f"cylinder_{domain}_{offset}", domain=domain, offset=offset)
        for domain, offset in (
            ("fixed", 0.0),
            ("fixed", 0.1),
            ("fixed", 0.2),
            ("fixed", 0.6),
            ("fixed", 0.87),
            ("corners", 0.1),
            ("corners", 0.2),
            ("corners", 0.41),
            ("corners", 0.87),
        )
    ],
}
if __name__ == "__main__":
    main(CASES)
