"""Scenes that are given by a section (theory.md, Sections). usage: section.py (in an empty directory; GIMP3D
is the program)"""

import os
import subprocess
from pathlib import Path

import numpy as np
from run_scene import ROOT, replace, run
from checks import check, finish, require
from runs import energy, same_bits, snapshots, vector
from gimp3d.run_data import History

GRID = "&grid geometry='{geometry}', lower={lower}, upper={upper}, cell_size={cell}, boundary={boundary} /\n"
ROUND = "'symmetry','free','symmetry','symmetry',"


def breathing():
    """A thin ring that goes outwards comes back after half a period pi R sqrt(rho/E) (nu = 0): the time at
    which its speed turns, a quarter period, is where the strain energy is largest."""
    radius, width, rho, young = 20.0, 1.0, 1.0, 1.0e4
    quarter = 0.5 * np.pi * radius * np.sqrt(rho / young)
    run(
        f"&scene title='ring', end_time={1.2 * quarter} /\n"
        + GRID.format(
            geometry="axisymmetric",
            lower="0,0,0",
            upper="24,0.25,2",
            cell=0.25,
            boundary=ROUND + "'symmetry','symmetry'",
        )
        + f"&material name='m', model='elastic', density={rho}, young={young}, poisson=0 /\n"
        f"&body material='m', shape='box', lower={radius - width / 2},0,0, upper={radius + width / 2},1,2, "
        "particles_per_cell=8, velocity=0.01,0,0 /\n"
        "&output directory='ring', formats='none' /\n",
        1,
    )
    rows = energy("ring")
    strain, time = rows["strain"], rows["time"]
    n = int(np.argmax(strain))
    bend = np.polyfit(time[n - 20 : n + 21] - time[n], strain[n - 20 : n + 21], 2)
    found = time[n] - 0.5 * bend[1] / bend[0]
    print(f"   ring: a quarter period of {found:.5f} s, thin ring {quarter:.5f} s")
    # of thickness t: 1 + (t/R)^2/24 and less
    check("ring: quarter period", found / quarter - 1, 2e-3)
    mass = rho * 2 * np.pi * radius * width * 2
    check("ring: mass of all of it", rows["mass"][0] / mass - 1, 1e-12)
    # velocities stand half a step beside places: omega dt/2
    check("ring: energy", rows["balance_error"], 3e-3)


FLIGHT = (
    "&scene title='ring through a level', end_time=0.25 /\n"
    + GRID.format(
        geometry="axisymmetric", lower="0,0,0", upper="14,1,30", cell=1, boundary=ROUND + "'free','free'"
    )
    + """&time domain='{domain}' /
&level lower=0,0,8, upper=8,1,20 /
&material name='m', model='neo_hookean', density=1, young=1e4, poisson=0.3 /
&body material='m', shape='cylinder', center=0,0,3, radius=4, height=4, particles_per_cell=8,
      velocity=0,0,70 /
&output directory='{name}', formats='hdf5', every=0.25 /
"""
)


def flight():
    """Parts of rings split and merge; mass and momentum along the axis stay."""
    for domain in ("fixed", "stretch", "corners"):
        said = run(FLIGHT.format(domain=domain, name=domain), 1)
        words = said.split("domains: ")[1].split()
        split, merged, left = int(words[0]), int(words[5]), int(words[9])
        print(f"   {domain}: {split} made by splitting, {merged} by merging, {left} of 64 at the end")
        require(f"{domain}: rings split into four and merge", merged > 50 and left == 64 + split - 3 * merged)
        rows = energy(domain)
        check(f"{domain}: mass", rows["mass"] / rows["mass"][0] - 1, 1e-13)
        momentum = vector(rows, "momentum")
        check(f"{domain}: momentum", (momentum - momentum[0]) / momentum[0].max(), 1e-12)
    for ranks in (2, 4):
        run(FLIGHT.format(domain="corners", name=f"ranks_{ranks}"), ranks)
        same_bits("corners", f"ranks_{ranks}")


SPHERE = (
    "&scene title='sphere', end_time=3e-8 /\n"
    + GRID.format(
        geometry="axisymmetric",
        lower="0,0,0",
        upper="22e-6,1e-6,22e-6",
        cell="1e-6",
        boundary=ROUND + "'roller','free'",
    )
    + """&level lower=0,0,12e-6, upper=8e-6,0,22e-6 /
&time domain='{domain}' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6, particles_per_cell=8 /
&tool name='sphere', shape='sphere', radius=10e-6, tip=0,0,20e-6, axis=0,0,-1, times=0,1e-8, speeds=0,20 /
&output directory='{name}', formats='none' /
"""
)


def sphere():
    """The load of the whole sphere beside finite elements, and the contact's radius."""
    table = np.loadtxt(ROOT / "test/references/fem/sphere_hypo_h0.1.csv", delimiter=",", comments="#")
    for domain in ("fixed", "corners"):
        run(SPHERE.format(domain=domain, name=f"sphere_{domain}"), 1)
        rows = History(Path(f"sphere_{domain}/tool_sphere.dat"))
        depth, load = rows["depth"] * 1e6, rows["load_z"] * 1e6
        late = depth > 0.25
        off = load[late] / np.interp(depth[late], table[:, 0], table[:, 1]) - 1
        radius = np.sqrt(rows["contact_area"][late] / np.pi) * 1e6
        wide = radius / np.interp(depth[late], table[:, 0], table[:, 2]) - 1
        print(f"   sphere, {domain}: load {100 * off.mean():+.2f} %, radius {100 * wide.mean():+.2f} %")
        check(f"sphere, {domain}: load", off.mean(), 1e-2)
        check(f"sphere, {domain}: contact radius", wide.mean(), 4e-2)
        balance = energy(f"sphere_{domain}")
        check(f"sphere, {domain}: energy", balance["balance_error"][-1], 5e-4)


WEDGE = """&scene title='wedge', end_time=0.01 /
{grid}&time domain='corners' /
&material name='m', model='j2', density=1, young=1e4, poisson=0.3, yield_stress=100 /
&body material='m', shape='box', lower=0,0,0, upper=8,0.5,8, particles_per_cell=8 /
&tool name='wedge', shape='wedge', half_angle=70, edge=0,1,0, tip=0,0,8, axis=0,0,-1, times=0,1e-3, speeds=0,50 /
&output directory='{name}', formats='none' /
"""


def plane():
    """Plane strain is a slice of 3D, of one metre."""
    for name, geometry in (("slice", "3d"), ("plane", "plane_strain")):
        grid = GRID.format(
            geometry=geometry, lower="0,0,0", upper="10,0.5,10", cell=0.5, boundary=ROUND + "'roller','free'"
        )
        run(WEDGE.format(grid=grid, name=name), 1)
    load = {name: History(Path(f"{name}/tool_wedge.dat"))["load_z"] for name in ("slice", "plane")}
    check("plane strain: load of a metre", (load["plane"] - 2 * load["slice"]) / load["plane"].max(), 1e-9)


TUBE = (
    "&scene title='tube', end_time=1 /\n"
    + GRID.format(
        geometry="axisymmetric",
        lower="0,0,0",
        upper="10,{cell},1",
        cell="{cell}",
        boundary=ROUND + "'symmetry','symmetry'",
    )
    + """&time domain='{domain}' /
&material name='m', model='elastic', density=1, young=1e4, poisson=0.3 /
&body material='m', shape='box', lower=4,0,0, upper=8,1,1, particles_per_cell=8 /
&pressure lower=4,0,0, upper=4,1,1, times=0, values=0.01 /
&quasi_static step=1 /
&output directory='{name}', formats='hdf5' /
"""
)


def tube():
    """A tube under inner pressure of 1e-6 E, held along its axis, by one quasi-static step: Lame's
    displacements."""
    inner, outer, young, poisson = 4.0, 8.0, 1e4, 0.3
    worst = []
    for domain, cell in (("stretch", 0.5), ("corners", 0.5), ("corners", 0.25)):
        name = f"tube_{domain}_{cell}"
        run(TUBE.format(domain=domain, cell=cell, name=name), 1)
        if domain == "stretch":  # the case that was used is a scene again
            run(replace((Path(name) / "case.nml").read_text(), f"'{name}'", f"'{name}_again'"), 1)
        first, last = snapshots(name)
        order = [np.argsort(one.ids) for one in (first, last)]
        r, now = (one["position"][o, 0] for one, o in zip((first, last), order))
        factor = 0.01 * (1 + poisson) / young * inner**2 / (outer**2 - inner**2)
        exact = factor * ((1 - 2 * poisson) * r + outer**2 / r)
        worst.append(np.abs((now - r) / exact - 1).max())
        check(f"tube, {domain}, cells of {cell}: displacements", worst[-1], 2e-3)
    check("tube: order", 4 * worst[2] / worst[1], 1.2)


def cone():
    """Metal under a cone in quasi-static steps: Newton's method converges as with exact tangents, and the load
    grows with the square of the depth."""
    text = (ROOT / "input/static_cone.nml").read_text()
    said = run(replace(replace(text, "step=0.05", "step=0.2"), "out/static_cone", "cone"), 1)
    newton = float(said.split(" steps, ")[-1].split(" Newton")[0])
    check("cone: Newton iterations a step", newton, 7)
    rows = History(Path("cone/tool_cone.dat"))
    late = rows["depth"] > 0.5e-6
    curvature = rows["load_z"][late] / rows["depth"][late] ** 2 / 700e6
    print(f"   cone: load over depth squared {curvature.min():.1f} to {curvature.max():.1f} yield stresses")
    check("cone: load over depth squared, off 68 yield stresses", curvature / 68 - 1, 0.04)


def refusals():
    """One sentence each, status 2."""
    scene = SPHERE.format(domain="fixed", name="refused")
    for old, new, words in (
        ("22e-6,1e-6,22e-6", "22e-6,2e-6,22e-6", "y must be cell_size"),
        (ROUND, "'free','free','symmetry','symmetry',", "must be symmetry at x=0"),
        ("tip=0,0,20e-6", "tip=1e-6,0,20e-6", "must be at x = y = 0"),
        ("shape='sphere', radius=10e-6", "shape='berkovich'", "is no shape that is a body of revolution"),
        ("center=0,0,0,", "center=1e-6,0,0,", "must have its centre at x = y = 0"),
        ("&level", "&gravity acceleration=1,0,0 /\n&level", "along z"),
    ):
        done = subprocess.run(
            [os.environ["GIMP3D"]], input=replace(scene, old, new), capture_output=True, text=True
        )
        require(f"refused: {words}", done.returncode == 2 and words in done.stderr)


breathing()
flight()
sphere()
plane()
tube()
cone()
refusals()
finish()
