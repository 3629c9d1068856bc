"""&anti_locking in quasi-static steps (theory.md, eq. static-means), and what the ghost penalty bears of metal
that flows. usage: locking.py [long] (in an empty directory; GIMP3D is the program)"""

import re
import sys

import numpy as np

from static_scenes import ROOT, check, counts, finish, last_particles, require, run, tool
from run_scene import probe, replace

ON, OFF = "volumetric", "none"


def patch():
    """A block whose faces lie inside cells, under a pressure: means over cells leave one stress as it is."""
    run(
        "&scene title='patch', end_time=1 /\n&grid lower=0,0,0, upper=0.6,0.6,1, cell_size=0.1, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        "&material name='soft', model='neo_hookean', density=50, young=1e3, poisson=0.49 /\n"
        "&body material='soft', shape='box', lower=0,0,0, upper=0.35,0.35,0.65 /\n"
        "&pressure lower=0,0,0.65, upper=0.35,0.35,0.65, times=0,1, values=0,300 /\n"
        "&time domain='stretch' /\n&anti_locking /\n"
        "&quasi_static step=0.25, max_step=0.25, tolerance=1e-11 /\n&output directory='patch' /\n",
        1,
    )
    stress = last_particles("patch")["stress"]
    check("patch: spread of the stress, relative", np.ptp(stress, axis=0) / np.abs(stress).max(), 1e-8)


def e5(name, kind, steps, ranks=1, scene="bilinear_patch"):
    """Mean of the probes of E5 at its end: von Mises, szz, sxx in MPa; the spread of szz among them."""
    text = (ROOT / f"input/{scene}.nml").read_text()
    text = re.sub(r"directory='out/\w+', every=5e-6", f"directory='{name}', formats='none'", text)
    text = replace(text, "&anti_locking /\n", f"&anti_locking kind='{kind}' /\n{steps}")
    log = run(text, ranks)
    probes = [probe(name, letter) for letter in "abcdefgh"]
    means = [
        1e-6 * np.mean([one[column][-1] for one in probes])
        for column in ("von_mises", "stress_zz", "stress_xx")
    ]
    return np.array(means), 1e-6 * np.ptp([one["stress_zz"][-1] for one in probes]), log


STEPS = "&quasi_static step=2e-6, max_step=2e-6 /\n"


def patch_of_metal():
    """E5 has the stresses of explicit steps (whose kinetic energy is up to 1.4 % of the work), with means and
    without; without them they are others, and those of single particles swing."""
    static, spread, log = e5("static", ON, STEPS)
    check("E5: Newton iterations a step", counts(log)[1], 6)
    explicit, _, _ = e5("explicit", ON, "", ranks=2)
    check("E5: stresses against explicit steps, relative", static / explicit - 1, 0.04)
    two, _, _ = e5("two", ON, STEPS, ranks=2)
    check("E5: stresses on 2 ranks against 1, relative", two / static - 1, 1e-4)
    locked, swing, _ = e5("locked", OFF, STEPS)
    bare, _, _ = e5("explicit_locked", OFF, "", ranks=2)
    check("E5, no means: stresses against explicit steps, relative", locked / bare - 1, 0.04)
    require(
        f"control: without means szz is another, {locked[1]:.0f} for {static[1]:.0f} MPa, and swings by "
        f"{swing:.0f} for {spread:.0f} MPa",
        abs(locked[1] / static[1] - 1) > 0.1 and swing > 4 * spread,
    )


def ranks():
    """E5, whose cells several blocks share, in four steps on 1 and 2 ranks."""
    steps = "&quasi_static step=5e-6, max_step=5e-6 /\n"
    one, two = (e5(f"ranks_{n}", ON, steps, ranks=n)[0] for n in (1, 2))
    check("E5 in four steps: stresses on 2 ranks against 1, relative", two / one - 1, 1e-4)


def ball(name, kind, steps, more=""):
    """A ball pressed by 0.4 of a cell into metal of E/Y = 571, at 5.7 m/s, and held."""
    return f"""&scene title='{name}', end_time=1.2e-4 /
&grid lower=0,0,0, upper=8e-3,8e-3,6e-3, cell_size=1e-3, boundary='symmetry','free','symmetry','free','fixed','free' /
&material name='steel', density=7850, model='j2', young=200e9, poisson=0.3, yield_stress=350e6, hardening_modulus=1e9 /
&body material='steel', shape='box', lower=0,0,0, upper=6e-3,6e-3,4.5e-3 /
&tool name='ball', shape='sphere', radius=4e-3, tip=0,0,4.5e-3, times=0,0.2e-4,0.7e-4,0.9e-4, speeds=0,5.714,5.714,0 /
&time domain='stretch' /
&anti_locking kind='{kind}' /
{f"&quasi_static step={steps}, max_step={steps}{more} /" if steps else ""}
&output directory='{name}', formats='none' /
"""


def metal():
    """The load in motion hangs little on the step, for at the surface the ghost penalty resists about as metal
    that flows does, and not as elastic metal, which takes some ten times the penalty (control). It is near
    that of explicit steps; held it is that, and explicit steps go on from it."""
    for kind, by_steps, by_scheme in ((ON, 0.15, 0.1), (OFF, 0.05, 0.03)):
        moving, held = {}, {}
        for name, steps, more in (
            ("long", 1.8e-5, ""),
            ("stiff", 1.8e-5, ", stabilisation=0.37"),
            ("short", 4.5e-6, ""),
            ("explicit", 0, ""),
            ("on", 4.5e-6, ", to=0.9e-4"),
        ):
            run(ball(f"{name}_{kind}", kind, steps, more), 1 if steps else 2)
            history = tool(f"{name}_{kind}", "ball")
            moving[name] = history["load_z"][abs(history["time"] - 0.7e-4) < 0.02e-4].mean()
            held[name] = history["load_z"][history["time"] > 1.0e-4].mean()
        moving = {name: load / moving["short"] - 1 for name, load in moving.items()}
        held = {name: load / held["short"] - 1 for name, load in held.items()}
        check(f"ball, {kind}: in motion, by steps of 0.1 of 0.025 cells", moving["long"], by_steps)
        require(
            f"control: the same with a stiff penalty {moving['stiff']:+.1%}", moving["stiff"] > 2 * by_steps
        )
        check(f"ball, {kind}: in motion, explicit of quasi-static steps", moving["explicit"], by_scheme)
        check(f"ball, {kind}: held, explicit of quasi-static steps", held["explicit"], 0.02)
        check(f"ball, {kind}: explicit steps that go on from it", held["on"], 0.05)


FEM = {"von_mises": 145.0, "stress_zz": -394.0, "stress_xx": -250.0}  # MPa, finite elements


def fine():
    """E5 on cells of 0.25 mm: the recovered stress of the eight particles around (0.25, 0.25, 6.75) mm against
    finite elements."""
    text = (ROOT / "input/bilinear_patch.nml").read_text()
    text = replace(text, "cell_size=0.5e-3", "cell_size=0.25e-3")
    text = replace(text, "'out/bilinear_patch', every=5e-6", "'fine', formats='none'")
    text = replace(text, "&anti_locking /\n", f"&anti_locking /\n{STEPS}")
    text = re.sub("^&probe.*\n", "", text, flags=re.M)
    names = [f"p{corner}" for corner in range(8)]
    for corner, name in enumerate(names):
        at = [x + 0.125 * (corner >> i & 1) - 0.0625 for i, x in enumerate((0.25, 0.25, 6.75))]
        text += f"&probe name='{name}', position={','.join(f'{x}e-3' for x in at)} /\n"
    log = run(text, 2)
    check("E5, 0.25 mm: Newton iterations a step", counts(log)[1], 6)
    for column, reference in FEM.items():
        recovered = "von_mises_recovered" if column == "von_mises" else column.replace("_", "_recovered_")
        found = 1e-6 * np.mean([probe("fine", name)[recovered][-1] for name in names])
        print(f"   {column}: {found:.1f} MPa, finite elements {reference:.0f} MPa")
        check(f"E5, 0.25 mm: recovered {column} against finite elements", found / reference - 1, 0.03)


if __name__ == "__main__":
    if sys.argv[1:] == ["long"]:
        patch_of_metal()
        fine()
    else:
        patch()
        ranks()
        metal()
    finish()
