"""Bodies at rest on each other: load, stress in the layers beside the interface, a stiff body on a soft one.
Columns between symmetry sides, on a base that is a rigid tool, so that the interface may be at any height of
a cell. The cells are 1 m."""

from meeting import *

DOMAINS = ("fixed", "stretch", "corners")


def column(
    name,
    lower,
    upper,
    offset,
    groups=True,
    domain="fixed",
    per_cell=8,
    ranks=1,
    size=1.0,
    wide=1,
    extra="",
    steps=2500,
):
    """Two blocks under gravity, damped; the lower one is `lower` high and begins at `offset` (cells of
    `size`, m)."""
    pull = 1e-3 * YOUNG / (DENSITY * (lower + upper))
    first, end = offset, steps * 0.3 * size / BAR_WAVE
    swing = math.pi * BAR_WAVE / (2 * (lower + upper))
    across = wide * size
    run = Run(
        name,
        f"""&scene title='two blocks at rest', end_time={end!r} /
&grid lower=0,0,{-2 * size!r}, upper={across!r},{across!r},{(math.ceil((lower + upper) / size) + 3) * size!r}, cell_size={size!r},
      boundary='symmetry','symmetry','symmetry','symmetry','free','free' /
&time domain='{domain}' /
&material name='m', model='elastic', density={DENSITY}, young={YOUNG}, poisson=0 /
&body material='m', shape='box', lower=0,0,{first!r}, upper={across!r},{across!r},{first + lower!r}, particles_per_cell={per_cell}
      {group(groups and 'a')} /
&body material='m', shape='box', lower=0,0,{first + lower!r}, upper={across!r},{across!r},{first + lower + upper!r},
      particles_per_cell={per_cell} {group(groups and 'b')} /
&tool name='base', shape='flat', radius={10 * across!r}, tip=0,0,{first!r}, axis=0,0,1, times=0, speeds=0, penetration_factor=0.5 /
&gravity acceleration=0,0,{-pull!r} /
&damping kind='viscous', coefficient={2 * swing!r} /
{extra}&output directory='OUT', formats='hdf5' /
""",
        ranks,
    )
    weight = DENSITY * pull * across**2
    return run, weight, first + lower


def layers(run, weight, interface, top, across, size):
    """Stress over the exact one in the two layers of particles on either side of the interface."""
    last = run.last()
    height, stress = last["position"][:, 2], -last["stress"][:, 2] * across**2
    edge = np.cbrt(last["volume"] if "volume" in last.fields else last["mass"] / DENSITY)
    exact = weight * (top - height)
    near = abs(height - interface) < 2 * edge
    return stress[near] / exact[near]


def at_rest(name, offsets, lower=7.0, upper=5.0, **kind):
    loads, shares = [], []
    size, across = kind.get("size", 1.0), kind.get("wide", 1) * kind.get("size", 1.0)
    for offset in map(float, offsets):
        run, weight, interface = column(f"{name}_{offset:.3f}", lower, upper, offset * size, **kind)
        time, force = run.force()
        speed = np.sqrt(2 * run.energy["kinetic"][-1] / run.energy["mass"][-1])
        loads.append(-force[-1, 2] / (upper * weight) - 1)
        shares.append(layers(run, weight, interface, offset * size + lower + upper, across, size))
        print(
            f"   {name}, {offset:.3f} cells: load over weight - 1: {loads[-1]:.2e}, layers "
            f"{shares[-1].min():.3f} to {shares[-1].max():.3f}; speed {speed:.1e} m/s"
        )
    # cubes, one a cell, creep for ever at some 1e-5 of the wave speed, in one field too, and damping pulls on
    # that
    creeps = kind.get("per_cell") == 1 and kind.get("domain") != "corners"
    check(f"{name}: load over weight, off 1", np.array(loads), 0.05 if creeps else 1e-6)
    shares = np.concatenate(shares)
    check(f"{name}: stress of two layers on each side over the exact, off 1", shares - 1, 0.08)


def stiff(name, cells, offset, groups=True, ratio=1e4, domain="fixed", per_cell=8, ranks=1):
    """A stiff block on one 10^4 times softer, equally thick (`cells`), between rollers, Poisson 0, pressed by
    5 % of the soft one. Exactly, the stress is E ln(1 - strain) of the soft layer everywhere. Load and
    stresses over it."""
    soft, pressed, size = 1e6, 0.05, 4 / cells
    base = offset * size
    swing, speed = math.sqrt(soft / 4 / (DENSITY * 4)), pressed * 4 / 1.8
    run = Run(
        name,
        f"""&scene title='stiff on soft', end_time=3 /
&grid lower=0,0,{-2 * size!r}, upper={size!r},{size!r},{8 + 3 * size!r}, cell_size={size!r},
      boundary='symmetry','symmetry','symmetry','symmetry','free','free' /
&time domain='{domain}' /
&material name='soft', model='elastic', density={DENSITY}, young={soft!r}, poisson=0 /
&material name='stiff', model='elastic', density={DENSITY}, young={soft * ratio!r}, poisson=0 /
&body material='soft', shape='box', lower=0,0,{base!r}, upper={size!r},{size!r},{4 + base!r}, particles_per_cell={per_cell}
      {group(groups and 'soft')} /
&body material='stiff', shape='box', lower=0,0,{4 + base!r}, upper={size!r},{size!r},{8 + base!r}, particles_per_cell={per_cell}
      {group(groups and 'stiff')} /
&tool name='base', shape='flat', radius=8, tip=0,0,{base!r}, axis=0,0,1, times=0, speeds=0 /
&tool name='flat', shape='flat', radius=8, tip=0,0,{8 + base!r}, times=0,0.2,1.8,2, speeds=0,{speed!r},{speed!r},0,
      penetration_factor=0.5 /
&damping kind='viscous', coefficient={2 * swing!r} /
&output directory='OUT', history_every=0.003 /
""",
        ranks,
    )
    rows = run.history("tool_flat")
    depth = rows["depth"][-1]
    exact = -soft * math.log(1 - depth / (4 + 4 / ratio))
    load = np.mean(rows["load_z"][rows["time"] > 2.9]) / size**2 / exact
    last = run.last()
    stress, is_soft = -last["stress"][:, 2] / exact, last["position"][:, 2] < 4 + base - depth
    print(
        f"   {name}: load {load:.4f}, soft {stress[is_soft].min():.3f} to {stress[is_soft].max():.3f}, stiff "
        f"{stress[~is_soft].min():.3f} to {stress[~is_soft].max():.3f}",
        flush=True,
    )
    return load, stress


def stiff_on_soft(settings, ratio=1e4):
    for cells, offset, domain, per_cell in settings:
        what = f"stiff on {cells} soft cells, {offset} cells over a node plane, {domain}, {per_cell} a cell"
        load, stress = stiff(
            f"stiff_{cells}_{offset}_{domain}_{per_cell}",
            cells,
            offset,
            domain=domain,
            per_cell=per_cell,
            ratio=ratio,
        )
        check(f"{what}: load over the exact, off 1", load - 1, 0.01)


def one_field():
    load, _ = stiff("one_field", 4, 0.0, groups=False, ratio=1e2)
    require(
        f"control: in one velocity field the load is off by more than a tenth, not {load - 1:.1%}",
        abs(load - 1) > 0.1,
    )


OFFSETS = (0.0, 0.2, 0.4, 0.6, 0.8)
CASES = {
    "at_rest": lambda: at_rest("fixed", (0.37,), steps=2000),
    "at_rest_long": lambda: (
        [
            at_rest(f"{domain}_{per_cell}", np.linspace(0, 1, 11)[:-1], domain=domain, per_cell=per_cell)
            for domain in DOMAINS
            for per_cell in (1, 8, 27)
        ],
        at_rest("half_cells", np.linspace(0, 1, 11)[:-1], size=0.5),
        at_rest("4_cells_wide", (0.0, 0.31), wide=4),
    ),
    "levels": lambda: at_rest(
        "levels",
        (0.3,),
        3.0,
        2.0,
        domain="corners",
        per_cell=1,
        wide=4,
        steps=500,
        extra="&level lower=0,0,-2, upper=4,4,4 /\n",
    ),
    "levels_long": lambda: [
        at_rest(
            f"levels_{domain}",
            (0.0, 0.37),
            5.0,
            3.0,
            domain=domain,
            wide=4,
            steps=1500,
            extra="&level lower=0,0,-2, upper=4,4,7 /\n",
        )
        for domain in ("fixed", "corners")
    ],
    "stiff": lambda: stiff_on_soft([(4, 0.4, "fixed", 8)], ratio=3e2),
    "one_field": one_field,
    "stiff_long": lambda: stiff_on_soft(
        [(cells, offset, "fixed", 8) for cells in (4, 8) for offset in OFFSETS]
        + [
            (4, offset, domain, per_cell)
            for offset in (0.0, 0.4, 0.7)
            for domain, per_cell in (
                ("stretch", 8),
                ("corners", 8),
                ("fixed", 1),
                ("fixed", 27),
                ("corners", 1),
                ("corners", 27),
            )
        ]
    ),
}
if __name__ == "__main__":
    main(CASES)
