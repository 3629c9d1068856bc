"""friction_law='coulomb_tresca': a flat tool that presses a whole face and drags across it, and a block that
is pressed against another one and dragged over it. Where Coulomb's friction would be above the limit everywhere, the
tangential force is the limit times the area, whatever the pressure; below it, Coulomb's coefficient times the
normal force; without the limit (a control) Coulomb's force is another one. Explicit steps and quasi-static
ones. Cells of 1 m."""

import os
import subprocess
import sys
from pathlib import Path
from checks import close, finish

YOUNG, MU, TAU, SIDE = 1e6, 0.2, 40.0, 4.0
TOOL = "&tool name='t', shape='flat', radius=20, tip=2,2,4, times=0,0.49,0.5, speeds=3.2e-3,3.2e-3,0"
SLIDE = "&motion tool='t', kind='slide', axis=1,0,0, times=0.5,0.51, speeds=0,4e-3 /\n"
UPPER = (
    "&body material='m', shape='box', lower=0,0,2, upper=4,4,4, particles_per_cell=8, contact_group='b' /\n"
)
BOX = """&grid lower=-4,-4,0, upper=8,8,9, cell_size=1, boundary='free','free','free','free','fixed','free' /
&time domain='fixed' /
&material name='m', model='elastic', density=1000, young=1e6, poisson=0 /
&body material='m', shape='box', lower=0,0,0, upper=4,4,{top}, particles_per_cell=8 {group} /
"""
STATIC = "&quasi_static step=0.05, max_step=0.05 /\n"


def run(name, text):
    scene = f"&scene title='{name}', end_time=1 /\n{text}&output directory='{name}', history_every=0.05 /\n"
    done = subprocess.run([os.environ["GIMP3D"]], input=scene, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"FAILED: {name}: {done.stderr[-400:]}")
    return Path(name)


def table(path):
    """Rows of a history."""
    lines = path.read_text().splitlines()
    columns = next(line for line in lines if line.startswith("VARIABLES"))
    names = [word.split(" [")[0] for word in columns.split('"')[1::2]]
    return [dict(zip(names, map(float, line.split()))) for line in lines if line.startswith("  ")]


def tool(name, law, kind=""):
    """Pressed by 1.6 mm in the first half, then dragged by 2 mm."""
    at = run(name, BOX.format(top=4, group="") + kind + f"{TOOL}, {law} /\n" + SLIDE)
    row = table(at / "tool_t.dat")[-1]
    return abs(row["load_x"]), abs(row["load_z"])


def drag(name, law, kind="", slide=SLIDE):
    """The upper of two blocks is pressed down and dragged by a tool that holds it fast."""
    return run(
        name,
        BOX.format(top=4, group=", contact_group='plate'").replace("upper=4,4,4", "upper=4,4,2")
        + UPPER
        + kind
        + f"&body_contact {law} /\n"
        + f"{TOOL}, friction=10 /\n"
        + slide,
    )


def block(name, law, kind=""):
    at = drag(name, law, kind)
    row = table(at / "contact_plate_b.dat")[-1]
    return abs(row["force_x"]), abs(row["force_z"])


LIMITED = f"friction_law='coulomb_tresca', friction={MU}, tau_max={TAU}"
for scene, what, bound in ((tool, "a tool", 1e-6), (block, "a block on another", 2e-3)):
    for kind, steps in ((STATIC, "quasi-static"), ("", "explicit")):
        name = f"{scene.__name__}_{steps}"
        friction, pressing = scene(name, LIMITED, kind)
        close(f"{what}, {steps}: friction over the area", friction / SIDE**2, TAU, bound)
        friction, pressing = scene(name + "_high", LIMITED.replace(f"={TAU}", "=1e9"), kind)
        free, _ = scene(name + "_coulomb", f"friction={MU}", kind)
        close(f"{what}, {steps}: as Coulomb's where the limit is far away", friction, free, 1e-9)
        if not free > 1.5 * TAU * SIDE**2:
            sys.exit("FAILED: control: Coulomb's friction is not another one")
        if scene is tool and kind:
            close(f"{what}, {steps}: Coulomb's", free, MU * pressing, 1e-6)

# Friction stays over a long slip. The blocks' sides lie on planes of nodes, which they pass by 1e-7 of a cell
# on the way: the nodes there must not strain the particles at the side.
LONG = SLIDE.replace("4e-3", "8e-3")
for name, law, shear in (
    ("far", "friction_law='coulomb_tresca', friction=0.5, tau_max=50", 50.0),
    ("far_coulomb", "friction=0.0125", None),
):
    shares = [
        abs(row["force_x"] / (shear * SIDE**2 if shear else 0.0125 * row["force_z"]))
        for row in table(drag(name, law, STATIC, LONG) / "contact_plate_b.dat")
        if row["time"] > 0.65
    ]
    close(f"a block on another, {name}: least friction", min(shares), 1.0, 2e-3)
    close(f"a block on another, {name}: largest", max(shares), 1.0, 2e-3)
finish()
