"""A rigid sphere pressed into a film on a base twice as soft, beside the exact integral equation
(post/gimp3d/layered.py; the family of B8 of the book of benchmarks): film and base of one velocity field, bonded to
each other as two contact groups, and free to slide on each other. The base is two films deep and bonded to a
rigid bottom; the block ends far from the contact. Lengths in cells."""

from meeting import *

from gimp3d.layered import Layers

# a/t at the end; radius of the sphere and depth of the base in films
POISSON, CONTACT, RADIUS, DEEP = 0.3, 0.5, 5.0, 2.0


def exact(ratio, slides):
    """Depth and load of a contact of radius a = t/2, in units of t and E_f' t^2."""
    load, depth = Layers(POISSON, ratio, POISSON, DEEP, slides=slides).press(CONTACT, "sphere")
    return depth / (2 * RADIUS), load / (2 * RADIUS)


def film(
    name,
    law="",
    ratio=2.0,
    thick=6,
    groups=True,
    domain="fixed",
    slides=False,
    wide=6,
    transits=10,
    per_cell=8,
):
    """Load over the exact at the depth where the contact has half of the film's thickness as its radius."""
    young, base = YOUNG, YOUNG / ratio
    depth, load = exact(ratio, slides)
    depth, load = depth * thick, load * young / (1 - POISSON**2) * thick**2
    high, across = int((1 + DEEP) * thick), wide * thick
    wave = math.sqrt(base * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON)) / DENSITY)
    end = transits * 2 * high / wave
    speed = 1.02 * depth / (0.75 * end)  # speeding up for half of the time
    run = Run(
        name,
        f"""&scene title='film', end_time={end!r} /
&grid lower=0,0,0, upper={across + 3},{across + 3},{high + 3}, cell_size=1, boundary='symmetry','free','symmetry','free','fixed','free' /
&time domain='{domain}' /
&material name='film', model='elastic', density={DENSITY}, young={young!r}, poisson={POISSON} /
&material name='base', model='elastic', density={DENSITY}, young={base!r}, poisson={POISSON} /
&body material='base', shape='box', lower=0,0,0, upper={across},{across},{high - thick}, particles_per_cell={per_cell} {group(groups and 'a')} /
&body material='film', shape='box', lower=0,0,{high - thick}, upper={across},{across},{high}, particles_per_cell={per_cell}
      {group(groups and 'b')} /
{law}
&tool name='sphere', shape='sphere', radius={RADIUS * thick}, tip=0,0,{high}, axis=0,0,-1, times=0,{0.5 * end!r}, speeds=0,{speed!r},
      penetration_factor=0.5 /
&output directory='OUT', formats='none', history_every={end / 400!r} /
""",
    )
    rows = run.history("tool_sphere")
    found = np.interp(depth, rows["depth"], abs(rows["load_z"])) / float(rows.notes["model_share"])
    kinetic = run.energy["kinetic"][-1] / max(run.energy["external_work"][-1], 1e-300)
    print(
        f"   {name}: load over the exact {found / load:.4f}; kinetic energy over work {kinetic:.4f}",
        flush=True,
    )
    return found / load


# up to a tenth of the film's modulus
BONDED = f"&body_contact adhesion={0.1 * YOUNG * 0.2!r}, bond_strength={0.1 * YOUNG!r} /"
# slides without friction, and does not lift off
STAYS = f"&body_contact adhesion={0.1 * YOUNG * 0.4!r}, cohesive_range=0.4 /"


def compared(ratio, bound, **kind):
    one = film(f"one_{ratio}", groups=False, ratio=ratio, **kind)
    bonded = film(f"bonded_{ratio}", BONDED, ratio=ratio, **kind)
    slides = film(f"slides_{ratio}", STAYS, ratio=ratio, slides=True, **kind)
    film(f"lifts_{ratio}", ratio=ratio, slides=True, **kind)
    for what, found in (("one velocity field", one), ("bonded groups", bonded), ("free to slide", slides)):
        check(f"film, {ratio} times as stiff, {what}: load over the exact, off 1", found - 1, bound)
    check(
        f"film, {ratio} times as stiff: bonded groups over one velocity field, off 1", bonded / one - 1, 0.02
    )


CASES = {
    "film": lambda: compared(2.0, 0.05, thick=4, wide=5, transits=6),
    "film_long": lambda: (
        compared(2.0, 0.03, thick=6, wide=5, transits=6),
        compared(10.0, 0.035, thick=4, wide=8, transits=6),
    ),
}
if __name__ == "__main__":
    main(CASES)
