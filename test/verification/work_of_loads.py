"""Work of loads by the motion of particles, against exact answers and against what is booked (theory.md, eq.
particle-work). usage: work_of_loads.py (in an empty directory; GIMP3D is the program)"""

import re
from pathlib import Path

import numpy as np

from run_scene import run, probe
from checks import check, finish, require
from runs import energy, same_bits

ROD = """&scene title='rod', end_time=0.3 /
&grid lower=0,0,0, upper={width},{width},1.5, cell_size=0.1, boundary='symmetry','symmetry','symmetry','symmetry','symmetry','free' /
&material name='rod', model='elastic', density=1000, young=1e6, poisson=0 /
&body material='rod', shape='box', lower=0,0,0, upper={width},{width},1, particles_per_cell={particles} /
&pressure lower=0,0,1, upper={width},{width},1, times=0,0.1, values=0,{pressure} /
&damping kind='viscous', coefficient=50 /
&probe name='end', position={inside},{inside},{last} /
{more}&output directory='{name}', history_every=1e-3, formats='hdf5' /
"""


def rod(name, pressure, particles, more="", width=0.1, ranks=1):
    """A load that rises and stays on a bar without cross contraction: the work is the integral of p A du at
    its end, which the probe's particle is half its edge from."""
    edge = 0.1 / round(particles ** (1 / 3))
    text = ROD.format(
        name=name,
        pressure=pressure,
        particles=particles,
        inside=edge / 2,
        last=1 - edge / 2,
        width=width,
        more=more,
    )
    log = run(text, ranks)
    rows, end = energy(name), probe(name, "end")
    way = end["z"] - end["z"][0]
    load = -np.interp(rows["time"], [0, 0.1], [0, pressure]) * width**2
    exact = np.concatenate([[0], np.cumsum(0.5 * (load[1:] + load[:-1]) * np.diff(way))]) / (1 - edge / 2)
    scale = np.abs(exact).max()
    check(
        f"{name}: work by the motion of particles against p A u",
        (rows["particle_work"] - exact) / scale,
        0.015,
    )
    check(f"{name}: booked work against it", (rows["external_work"] - rows["particle_work"]) / scale, 0.005)
    require(f"{name}: no warning", "WARNING" not in log)
    return text


def fall(name, law):
    """Gravity on a turning body in free flight through an edge of levels: the work is m g times the way of
    its centre of mass. In metal the means of anti-locking take the place of the nodes' values of blocks whose
    particles all belong to the finer level."""
    text = (
        f"&scene title='{name}', end_time=0.2 /\n&grid lower=0,0,0, upper=2,2,2.4, cell_size=0.1 /\n"
        "&level lower=0.4,0.4,0.3, upper=1.6,1.6,1.3 /\n"
        f"&material name='soft', {law}, density=1000, young=1e6, poisson=0.3 /\n"
        "&body material='soft', shape='box', lower=0.7,0.7,1.1, upper=1.2,1.1,1.5, velocity=0.3,0,-1, "
        "angular_velocity=0,1,2 /\n&gravity acceleration=0,2,-9.81 /\n"
        f"&output directory='{name}', formats='none', history_every=1e-9 /\n"
    )
    log = run(text, 2)
    rows = energy(name)
    time, mass = rows["time"], rows["mass"][0]
    exact = mass * (0.5 * 4 * time**2 + 9.81 * (1 * time + 0.5 * 9.81 * time**2))
    check(f"{name}: work by the motion of particles", (rows["particle_work"] - exact) / exact[-1], 1e-3)
    check(f"{name}: booked work", (rows["external_work"] - exact) / exact[-1], 1e-3)
    require(f"{name}: no warning", "WARNING" not in log)


PUNCH = """&scene title='punch', end_time=0.06 /
&grid lower=0,0,0, upper=1,1,1.2, cell_size=0.1, boundary='symmetry','free','symmetry','free','roller','free' /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0,0,0, upper=0.8,0.8,0.8 /
&tool name='tool', {shape}, tip=0,0,0.8, times=0,0.02,0.06, speeds=0,1,1, friction={friction} /
{more}&output directory='{name}', formats='none', history_every=1e-3 /
"""


def tools():
    """A flat punch moves particles as it moves itself; friction makes heat besides."""
    for name, friction in (("flat", 0), ("rough", 0.3)):
        log = run(PUNCH.format(name=name, shape="shape='flat', radius=0.35", friction=friction, more=""), 2)
        rows = energy(name)
        apart = (rows["external_work"] - rows["particle_work"]) / rows["external_work"][-1]
        check(
            f"{name} punch: work of the tool, booked and by the motion of particles",
            apart[len(apart) // 2 :],
            0.02,
        )
        require(f"{name} punch: no warning", "WARNING" not in log)


def limit():
    """Controls: a cone that is pressed into coarse cells is further apart than a limit that is made small for
    it: a fault, once, without retries, with the last good state on the disk. With a limit of 0 it is none."""
    cone = "shape='cone', half_angle=60"
    log = run(
        PUNCH.format(name="small", shape=cone, friction=0, more="&guard work_limit=1e-3 /\n"), 2, allowed=(3,)
    )
    said = re.findall(r"^gimp3d: (.*)", log, re.M)[-1]
    require(
        "limit: the sentence",
        re.search(
            r"^time \S+ ms: the work of the tools differs from the work on the particles that they "
            r"press: \S+ J of difference, more than 0.001 of the largest energy or work, \S+ J; try",
            said,
        )
        and "stands in small" in said,
    )
    require(
        "limit: no retry, for smaller steps do not heal it",
        "\nretry" not in log and "guard: no retries" in log,
    )
    require(
        "limit: it advises what the scene lacks",
        "; try smaller cells there, domain='corners'; the last" in said,
        said,
    )
    more = "&time domain='corners' /\n&damage tension_limit=1e12 /\n&guard work_limit=1e-3 /\n"
    log = run(PUNCH.format(name="advised", shape=cone, friction=0, more=more), 2, allowed=(3,))
    require(
        "limit: with 'corners' and failed material that stays it advises to erode it",
        "; try smaller cells there, erode=.true. in &damage; the last" in log,
    )
    sharp = "shape='cone', half_angle=20"
    log = run(PUNCH.format(name="sharp", shape=sharp, friction=0, more="&guard work_limit=0 /\n"), 1)
    require(
        "limit: the warning does not take the share for the error of loads",
        "WARNING: work of tools differs" in log and "by less or by more than this share" in log,
    )
    log = run(PUNCH.format(name="none", shape=cone, friction=0, more="&guard work_limit=0 /\n"), 1)
    apart = float(
        re.search(r"^AUXDATA work_apart_of_tools_J=\"(\S+)\"", Path("none/cost.dat").read_text(), re.M)[1]
    )
    rows = energy("none")
    check(
        "limit: cost.dat has the largest difference of energy.dat, relative",
        apart / np.abs(rows["external_work"] - rows["particle_work"]).max() - 1,
        1e-5,
    )


for pressure in (2e4, -2e4):
    for particles in (8, 27):
        rod(f"rod_{'push' if pressure > 0 else 'pull'}_{particles}", pressure, particles)
text = rod("rod_long_pull", -1e5, 8, more="&time domain='stretch' /\n")
rod("rod_on_levels", -2e4, 8, more="&level lower=0,0,0.6, upper=0.4,0.4,1.5 /\n", width=0.4, ranks=2)
run(text.replace("'rod_long_pull'", "'rod_on_2'"), 2)
same_bits("rod_long_pull", "rod_on_2")
fall("fall", "model='elastic'")
fall("fall_of_metal", "model='j2', yield_stress=1e6")
tools()
limit()
finish()
