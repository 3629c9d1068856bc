"""&pressure against exact answers (theory.md, eq. pressure). usage: pressure.py (in an empty directory;
GIMP3D is the program)"""

import math
import re
import sys
from pathlib import Path

import numpy as np

from run_scene import run
from checks import check, finish, require
from runs import energy, same_bits, snapshots, vector

CELL = 0.1
LAW = "&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /\n"
LAMBDA, SHEAR = 1e6 * 0.3 / (1.3 * 0.4), 1e6 / 2.6


def numbers(values):
    return ",".join(repr(float(v)) for v in values)


def patch(lower, upper, value):
    return f"&pressure lower={numbers(lower)}, upper={numbers(upper)}, times=0, values={value!r} /\n"


def total_force():
    """Patches that cut particles, over the borders of blocks, on two faces: every momentum is p A t. The
    pressure is so small that no strain changes an area by more than round-off."""
    text = (
        f"&scene title='push', end_time=0.2 /\n&grid lower=0,0,0, upper=2.4,2.4,2.4, cell_size={CELL} /\n"
        + LAW
        + "&body material='soft', shape='box', lower=0.43,0.51,0.57, upper=1.43,1.41,1.37 /\n"
        + patch([0.533, 0.6, 1.37], [1.291, 1.1117, 1.37], 1e-8)
        + patch([0.43, 0.51, 0.777], [0.43, 1.41, 0.9], 3e-8)
        + "&output directory='force', history_every=1e-9 /\n"
    )
    run(text, 2)
    rows = energy("force")
    time, momentum = rows["time"], vector(rows, "momentum")
    exact = np.outer(time, [3e-8 * 0.9 * 0.123, 0.0, -1e-8 * 0.758 * 0.5117])
    off = (momentum - exact)[1:] / np.abs(exact[-1]).max()
    check("momentum against p A t of two patches that cut particles, relative", off, 1e-12)
    check("balance of energy at the end", rows["balance_error"][-1], 0.05)


def pulses():
    """Pulses shorter than a step, and a jump within one, on two levels: after any step the momentum is the
    area times the integral of the table. Loads at the start of each step gave some of them nothing."""
    times = [0.0, 0.0101, 0.0102, 0.0104, 0.0105, 0.0407, 0.0408, 0.06, 0.1]
    values = [0.0, 0.0, 2e-7, 2e-7, 0.0, 0.0, 3e-8, 3e-8, -1e-8]
    text = (
        f"&scene title='pulses', end_time=0.12 /\n&grid lower=0,0,0, upper=2.4,2.4,2.4, cell_size={CELL} /\n"
        + LAW
        + "&level lower=0.8,0.8,0.8, upper=1.6,1.6,1.6 /\n"
        + "&body material='soft', shape='box', lower=0.4,0.4,0.4, upper=1.4,1.4,1.4 /\n"
        + "&pressure lower=0.4,0.6,1.4, upper=1.4,1.2,1.4, "
        + f"times={numbers(times)}, values={numbers(values)} /\n"
        + "&output directory='pulses', history_every=1e-9 /\n"
    )
    run(text, 2)
    rows = energy("pulses")
    t = np.unique(np.concatenate([times, rows["time"]]))
    p = np.interp(t, times, values)
    impulse = np.concatenate([[0], np.cumsum(0.5 * (p[1:] + p[:-1]) * np.diff(t))])
    exact = -0.6 * np.interp(rows["time"], t, impulse)
    off = vector(rows, "momentum")[:, 2] - exact
    check("momentum against the integral of pulses, relative", off / np.abs(exact).max(), 1e-12)
    work, own = rows["external_work"], rows["particle_work"]
    check("work of pulses at nodes less that on particles", (work - own) / np.abs(work).max(), 0.02)


def rounded_cell():
    """A cell that is said with twelve digits puts faces a hair beyond nodes, which have all of the force of
    next to no mass then: once that made 5e5 times the work."""
    work = []
    for n, cell in enumerate((0.1 / 3, 0.0333333333333, 0.033333333333)):
        text = (
            "&scene title='column', end_time=0.1 /\n&grid lower=0,0,0, "
            f"upper={6 * cell!r},{6 * cell!r},{9 * cell!r}, cell_size={cell!r},\n"
            + "boundary='symmetry','free','symmetry','free','roller','free' /\n"
            + LAW
            + "&body material='soft', shape='box', lower=0,0,0, upper=0.1,0.1,0.2 /\n"
            + patch([0, 0, 0.2], [0.05, 0.05, 0.2], 1e3)
            + f"&output directory='rounded_{n}' /\n"
        )
        run(text, 1)
        work.append(energy(f"rounded_{n}")["external_work"][-1])
    check(
        "work of a pressure with cells of twelve and thirteen digits against sixteen, relative",
        np.array(work) / work[0] - 1,
        1e-4,
    )


def uniform_stress(name, base, height, particles, both):
    """A column between rollers under a sudden pressure that stays, brought to rest: szz = -p in every
    particle, the work is p A u, and half of it is stored, half is damped but for what the transfer takes.
    Particles keep some noise that the nodes do not see and so cannot damp; a layer's mean has none. With one
    particle a cell the shock at the start moves nodes that no particle follows."""
    pressure, side = 1e3, 0.4
    top = base + height
    text = (
        f"&scene title='column', end_time=2 /\n&grid lower=0,0,0, upper={side},{side},1.6, "
        f"cell_size={CELL},\n"
        + f"boundary='roller','symmetry','symmetry','roller','{'free' if both else 'roller'}','free' /\n"
        + LAW
        + f"&body material='soft', shape='box', lower=0,0,{base!r}, upper={side},{side},{top!r}, "
        + f"particles_per_cell={particles} /\n"
        + patch([0, 0, top], [side, side, top], pressure)
        + (patch([0, 0, base], [side, side, base], pressure) if both else "")
        + f"&damping kind='local', coefficient=0.5 /\n&output directory='{name}' /\n"
    )
    run(text, 1)
    rows = energy(name)
    last = snapshots(name)[-1]
    stress = last.fields["stress"]
    sides = -pressure * LAMBDA / (LAMBDA + 2 * SHEAR)
    worst = np.abs(stress - [sides, sides, -pressure, 0, 0, 0]).max() / pressure
    off = (stress - [sides, sides, -pressure, 0, 0, 0]) / pressure
    check(f"{name}: stress of any particle against that of uniaxial strain under -p, over p", off, 0.01)
    heights = last.fields["position"][:, 2]
    for where, at in (("top", heights.max()), ("bottom", heights.min())):
        layer = np.abs(heights - at) < 0.1 * CELL
        require(f"{name}: a layer", layer.sum() == round(side / CELL * round(particles ** (1 / 3))) ** 2)
        check(f"{name}: mean stress of the layer at the {where}", off[layer].mean(axis=0), 0.002)
    work = pressure**2 * side**2 * height / (LAMBDA + 2 * SHEAR)
    check(
        f"{name}: work against p A u", rows["external_work"][-1] / work - 1, 0.002 if particles > 1 else 0.05
    )
    check(f"{name}: stored against half of it", rows["strain"][-1] / work - 0.5, 0.002)
    check(
        f"{name}: damped against half of it", rows["damped"][-1] / work - 0.5, 0.06 if particles > 1 else 0.1
    )
    require(
        f"{name}: no energy comes from nowhere: {rows['balance_error'][-1]}",
        rows["balance_error"][-1] < 0.005,
    )


def turning(ranks):
    """A block that turns by 90 degrees about y: the force on its top turns with it, so that the momentum is p
    A / omega times (1 - cos, 0, -sin) less the start."""
    pressure, rate = 50.0, 1.0
    end = 0.5 * math.pi / rate
    text = (
        f"&scene title='turning', end_time={end!r} /\n&grid lower=0,0,0, upper=2,2,2, cell_size={CELL} /\n"
        + LAW
        + "&body material='soft', shape='box', lower=0.7,0.7,0.75, upper=1.3,1.2,1.35, "
        "angular_velocity=0,1,0 /\n"
        + patch([0.7, 0.7, 1.35], [1.3, 1.2, 1.35], pressure)
        + f"&output directory='turning_{ranks}', every={end / 2!r}, history_every=0.01 /\n"
    )
    run(text, ranks)
    if ranks > 1:
        return same_bits("turning_1", f"turning_{ranks}")
    rows = energy("turning_1")
    time, momentum = rows["time"], vector(rows, "momentum")
    scale = pressure * 0.6 * 0.5 / rate
    exact = scale * np.stack([np.cos(rate * time) - 1, 0 * time, -np.sin(rate * time)], axis=1)
    check(
        "turning block: momentum against that of a force that turns with it, over p A / omega",
        (momentum - exact) / scale,
        0.01,
    )
    check("turning block: balance of energy", rows["balance_error"], 0.01)


def couple():
    """A couple of tractions turns a free cube: with lumped masses against its inertia and that of the cells,
    I + M h^2/3 (theory.md, Motion within particles), which goes with the square of the cell."""
    for cells, particles in ((2, 8), (4, 1), (4, 8), (4, 27), (8, 8)):
        size, end = 0.4, 0.05
        pair = "".join(
            f"&pressure lower=-0.2,-0.2,{z}, upper=0.2,0.2,{z}, "
            f"times=0, values={500 * z!r}, traction=1,0,0 /\n"
            for z in (-0.2, 0.2)
        )
        text = (
            f"&scene title='couple', end_time={end} /\n"
            f"&grid lower=3*-0.8, upper=3*0.8, cell_size={size / cells!r} /\n"
            + LAW
            + "&body material='soft', shape='box', lower=3*-0.2, upper=3*0.2, "
            + f"particles_per_cell={particles} /\n"
            + pair
            + f"&output directory='couple_{cells}_{particles}', history_every=0.002 /\n"
        )
        run(text, 1)
        rows = energy(f"couple_{cells}_{particles}")
        turned = vector(rows, "angular_momentum")[-1, 1] / (100 * size**3 * rows["time"][-1])
        slower = 1 / (1 + 2 / cells**2)
        label = f"couple on {cells} cells, {particles} a cell"
        most = 0.005 if particles == 1 else 0.002
        check(f"{label}: spin over {slower:.3f} of a rigid one", turned / slower - 1, most)


def oblique_traction():
    """A traction along and across the top of a free cube of 4 cells: its torque about the centre is that of a
    force at the middle of the top. It acted half a particle aside in the direction of the traction."""
    size, end, slower = 0.4, 0.05, 1 / (1 + 2 / 16)
    text = (
        f"&scene title='oblique', end_time={end} /\n"
        f"&grid lower=3*-0.8, upper=3*0.8, cell_size={size / 4!r} /\n&time domain='fixed' /\n"
        + LAW
        + "&body material='soft', shape='box', lower=3*-0.2, upper=3*0.2 /\n"
        "&pressure lower=-0.2,-0.2,0.2, upper=0.2,0.2,0.2, times=0, values=100, traction=2,0,-1 /\n"
        "&output directory='oblique', history_every=0.002 /\n"
    )
    run(text, 1)
    rows = energy("oblique")
    torque = 0.5 * size * 2 * 100 * size**2
    turned = vector(rows, "angular_momentum")[-1, 1] / (torque * rows["time"][-1])
    check("oblique traction: torque over that at the middle of the face", turned / slower - 1, 0.01)


def traction(follows):
    """A block that turns about y under a traction on its top, first along x. One that stays gives a momentum
    of p A t along x. One that turns with the face has a constant torque, so that the angle is known too, and
    the momentum is the integral of p A (cos, 0, -sin) of it."""
    pressure, rate = 10.0, 1.0
    end = 0.5 * math.pi / rate
    directory = f"traction_{'turns' if follows else 'stays'}"
    text = (
        f"&scene title='traction', end_time={end!r} /\n&grid lower=0,0,0, upper=2,2,2, cell_size={CELL} /\n"
        + LAW
        + "&body material='soft', shape='box', lower=0.7,0.7,0.75, upper=1.3,1.2,1.35, "
        "angular_velocity=0,1,0 /\n"
        + patch([0.7, 0.7, 1.35], [1.3, 1.2, 1.35], pressure).replace(
            " /\n", f", traction=1,0,0, follows={'.true.' if follows else '.false.'} /\n"
        )
        + f"&output directory='{directory}', every={end / 2!r}, history_every=0.01 /\n"
    )
    run(text, 1)
    rows = energy(directory)
    time, momentum = rows["time"], vector(rows, "momentum")
    scale = pressure * 0.6 * 0.5 / rate
    if follows:
        inertia = rows["mass"][0] * (0.6**2 + 0.6**2) / 12
        angle = rate * time + 0.5 * pressure * 0.6 * 0.5 * 0.3 / inertia * time**2
        force = pressure * 0.6 * 0.5 * np.stack([np.cos(angle), 0 * time, -np.sin(angle)], axis=1)
        steps = 0.5 * (force[1:] + force[:-1]) * np.diff(time)[:, None]
        exact = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    else:
        exact = scale * np.stack([rate * time, 0 * time, 0 * time], axis=1)
    check(f"{directory}: momentum against the exact one, over p A / omega", (momentum - exact) / scale, 0.015)
    booked = rows["external_work"][-1] / rows["particle_work"][-1]
    check(f"{directory}: work booked, off that of the particles' motion", booked - 1, 0.02)
    check(f"{directory}: balance of energy", rows["balance_error"], 0.015)


def pulled_rod(domain, particles, top, pressure, bar):
    """A rod between symmetry sides, pulled (pushed by a `pressure` below 0) at its end and damped: stress E
    ln(stretch) = p, as nu = 0. The work that is booked is that by the motion of the particles. The end is
    swept over a cell by where it stands at the start."""
    side, ramp = 0.1, 0.1
    directory = f"rod_{domain}_{particles}_{top:.3f}_{pressure:.0f}"
    text = (
        f"&scene title='rod', end_time=0.3 /\n&grid lower=0,0,0, upper={side},{side},2, cell_size={CELL},\n"
        + "boundary='symmetry','symmetry','symmetry','symmetry','symmetry','free' /\n"
        + f"&time domain='{domain}' /\n"
        + "&material name='rod', model='elastic', density=1000, young=1e6, poisson=0 /\n"
        + f"&body material='rod', shape='box', lower=0,0,0, upper={side},{side},{top!r}, "
        f"particles_per_cell={particles} /\n"
        + f"&pressure lower=0,0,{top!r}, upper={side},{side},{top!r}, times=0,{ramp}, values=0,{-pressure!r} "
        "/\n" + f"&damping kind='viscous', coefficient=50 /\n&output directory='{directory}' /\n"
    )
    run(text, 1)
    last = snapshots(directory)[-1]
    rows = energy(directory)
    x, mass = last.fields["position"][:, 2], last.fields["mass"]
    middle = 0.5 * top * math.exp(pressure / 1e6)  # of the mass, of a rod that is uniformly stretched
    name = f"rod, {domain}, {particles} a cell, {top:.3f} m, {pressure / 1e3:.0f} kPa"
    check(
        f"{name}: way of the middle of the mass, off the exact one",
        ((x * mass).sum() / mass.sum() - 0.5 * top) / (middle - 0.5 * top) - 1,
        bar,
    )
    check(
        f"{name}: work booked, off that of the particles' motion",
        rows["external_work"][-1] / rows["particle_work"][-1] - 1,
        0.01,
    )


SLEEVE = """&scene title='a soft core in a sleeve under pressure', end_time=1 /
&grid lower=0,0,0, upper=14e-3,14e-3,1e-3, cell_size=1e-3,
      boundary='symmetry','free','symmetry','free','symmetry','symmetry' /
&material name='hard', model='elastic', density=1000, young=1e9, poisson=0.3 /
&material name='soft', model='elastic', density=1000, young=1e8, poisson=0.3 /
&body name='core', material='soft', shape='cylinder', center=0,0,0, radius=6e-3, height=1e-3,
      contact_group='core' /
&body name='sleeve', material='hard', shape='cylinder', center=0,0,0, radius=10e-3, height=1e-3,
      contact_group='sleeve' /
&cut body='sleeve', shape='cylinder', center=0,0,-1e-3, radius=6e-3, height=3e-3 /
&pressure lower=0,0,0, upper=12e-3,12e-3,1e-3, times=0, values=1e6 /
&quasi_static step=1, max_step=1 /
&output directory='sleeve' /
"""


def sleeve():
    """A box that holds a closed interface presses on the free surface alone (Lame, plane strain)."""
    run(SLEEVE, 1)
    last = snapshots("sleeve")[-1].fields
    core = np.hypot(last["position"][:, 0], last["position"][:, 1]) < 5e-3
    a, b, nu = 6e-3, 10e-3, 0.3
    bore = (1 + nu) / 1e9 / (b**2 - a**2)  # radial displacement at a over a: of the sleeve by both pressures
    inner, outer = bore * ((1 - 2 * nu) * a**2 + b**2), bore * 2 * (1 - nu) * b**2
    pressure = 1e6 * outer / (inner + (1 + nu) * (1 - 2 * nu) / 1e8)
    check("sleeve: stress of the core, less 1", -last["stress"][core, 0].mean() / pressure - 1, 0.02)


def refused():
    """Off the body, over its edge, inside it, and half inside and half off: no run, no file."""
    for name, lower, upper, exact in (
        ("off the body", [0.4, 0.4, 1.2], [0.6, 0.6, 1.2], 0),
        ("over an edge", [0.2, 0.4, 1], [0.4, 0.6, 1], 0.02),
        ("inside", [0.4, 0.4, 0.8], [0.6, 0.6, 0.8], 0),
        ("half inside", [0.3, 0.4, 0.8], [1.3, 0.6, 0.8], 0),
    ):
        text = (
            "&scene title='refused', end_time=1 /\n&grid lower=0,0,0, upper=2,2,2, cell_size=0.1 /\n"
            + LAW
            + "&body material='soft', shape='box', lower=0.3,0.3,0.5, upper=0.8,0.8,1 /\n"
            + patch(lower, upper, 1.0)
            + "&output directory='refused' /\n"
        )
        said = re.findall("^gimp3d: .*", run(text, 2, allowed=(2,)), re.M)
        found = re.search(
            r"line \d+, &pressure: (\S+) m2 of the patch of \S+ m2 lie on faces of bodies; allowed: a patch",
            said[0],
        )
        require(
            f"a patch {name} is refused in one sentence: {said}",
            len(said) == 1 and found is not None and math.isclose(float(found[1]), exact, abs_tol=1e-12),
        )
        require(f"nothing is written for a patch {name}", not Path("refused").exists())
    print("   four patches that do not lie on a face are refused")


if __name__ == "__main__":
    total_force()
    pulses()
    rounded_cell()
    for name, base, height, particles, both in (
        ("base_0", 0.0, 0.8, 8, False),
        ("base_half", 0.0, 0.75, 8, False),
        ("base_third", 0.0, 0.7 + CELL / 3, 27, False),
        ("both_0.1", 0.31, 0.8, 8, True),
        ("both_0.37", 0.337, 0.75, 8, True),
        ("both_0.8", 0.38, 0.8, 1, True),
    ):
        uniform_stress(name, base, height, particles, both)
    every = sys.argv[1:] == ["long"]
    tops_27 = (1.0, 1.0 + CELL / 3, 1.0 + 2 * CELL / 3)
    for particles, tops in ((8, (1.0, 1.05)), (27, tops_27))[: 2 if every else 1]:
        for top in tops:
            for pressure in (50e3, 150e3) if every else (150e3,):
                pulled_rod("fixed", particles, top, pressure, 0.01)
            # its end passes a plane of nodes where cubes have not got shorter
            if top % CELL > 1e-9 and top % CELL < CELL - 1e-9:
                pulled_rod("fixed", particles, top, -CELL * (top / CELL % 1 + 0.04) / top * 1e6, 0.003)
            for domain in ("stretch", "corners"):
                for pressure in (150e3, 300e3) if every else (300e3,):
                    pulled_rod(domain, particles, top, pressure, 0.01)
    pulled_rod("corners", 1, 1.0, 150e3, 0.01)
    couple()
    oblique_traction()
    for ranks in (1, 2, 4) if every else (1, 2):
        turning(ranks)
    for follows in (False, True):
        traction(follows)
    sleeve()
    refused()
    finish()
