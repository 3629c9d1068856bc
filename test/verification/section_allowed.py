"""What scenes given by a section allow (theory.md, Sections). usage: section_allowed.py (in an empty
directory; GIMP3D is the program)"""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
from run_scene import ROOT, replace, run
from checks import check, finish, require
from runs import energy, same_bits, snapshots
from gimp3d.api import Scene
from gimp3d.run_data import History

SLICE = """&scene title='slice', end_time={end} /
&grid geometry='{geometry}', lower=0,0,0, upper=10,1,10, cell_size=1,
      boundary='symmetry','free','symmetry','symmetry','roller','free' /
&material name='m', model='j2', density=1, young=1e4, poisson=0.3, yield_stress=100 /
&body material='m', shape='box', lower=0,0,0, upper=8,1,8, particles_per_cell=8{flying} /
{effects}&output directory='{name}', formats='none' /
"""
WEDGE = (
    "&tool name='wedge', shape='wedge', half_angle=70, edge=0,1,0, tip=0,0,8, axis=0,0,-1, times=0,1e-3, "
    "speeds=0,60 /\n"
)


def slices():
    """Plane strain is a slice of 3D: with bulk viscosity under a tool, and where material fails and is taken
    out."""
    for name, effects, flying, end in (
        ("bulk", WEDGE + "&bulk_viscosity /\n", "", 0.02),
        ("spall", "&damage tension_limit=80, erode=.true. /\n", ", velocity=0,0,4", 0.05),
    ):
        rows = []
        for geometry in ("3d", "plane_strain"):
            run(
                SLICE.format(
                    geometry=geometry, effects=effects, flying=flying, end=end, name=f"{name}_{geometry}"
                ),
                1,
            )
            rows.append(energy(f"{name}_{geometry}"))
        for what in ("kinetic", "plastic", "damped", "mass"):
            size = max(np.abs(rows[0]["kinetic"]).max(), np.abs(rows[0][what]).max())
            check(f"{name}: {what}", (rows[1][what] - rows[0][what]) / size, 1e-9)
        if name == "spall":
            require("spall: material is taken out", rows[1]["mass"][-1] < 0.9 * rows[1]["mass"][0])


ROD = """&scene title='rod', end_time=20e-6 /
&grid geometry='axisymmetric', lower=0,0, upper=9.144e-3,27.432e-3, cell_size=0.508e-3,
      boundary='symmetry','free','symmetry','free' /
&time safety=0.3, domain='corners' /
&material name='m', density=8960, {law} /
&body material='m', shape='cylinder', center=0,0,0, radius=3.81e-3, height=25.4e-3, velocity=0,0,-10 /
&output directory='{name}', formats='none' /
"""


def users_law():
    """A user's law in C beside the same of the program: rates of Green and Naghdi, and of Jaumann."""
    source = ROOT / "input/vumat/elastic.c"
    subprocess.run(["cc", "-O2", "-fPIC", "-shared", "-o", "elastic.so", source], check=True)
    run(ROD.format(law="model='c_law', library='./elastic.so', constants=124e9, 0.34", name="own"), 1)
    run(ROD.format(law="model='elastic', young=124e9, poisson=0.34", name="given"), 1)
    own, given = energy("own"), energy("given")
    check("a user's law: motion", (own["kinetic"] - given["kinetic"]) / given["kinetic"][0], 1e-4)
    require("a user's law: the rod is stopped", given["kinetic"][-1] < 0.5 * given["kinetic"][0])


CREEP = """&scene title='cone', end_time=1 /
&grid geometry='axisymmetric', lower=0,0, upper=12e-6,12e-6, cell_size=1e-6,
      boundary='symmetry','free','roller','free' /
&material name='m', model='norton', density=2710, young=70e9, poisson=0.3, yield_stress=700e6,
          hardening_modulus=700e6, creep_stress=1e8,2e8, creep_rate=1e-3,1e-2 /
&body material='m', shape='cylinder', center=0,0,0, radius=10e-6, height=10e-6 /
&tool name='cone', shape='cone', half_angle=70.3, tip=0,0,10e-6, times=0, speeds=0.3e-6 /
&quasi_static step=0.2 /
&checkpoint every_steps=4 /
&output directory='creep', formats='hdf5' /
"""
FLIGHT = """&scene title='flight', end_time=0.25 /
&grid geometry='axisymmetric', lower=0,0, upper=14,30, cell_size=1, boundary='symmetry','free','free','free' /
&time domain='corners' /
&level lower=0,0,8, upper=8,1,20 /
&material name='m', model='neo_hookean', density=1, young=1e4, poisson=0.3 /
&body material='m', shape='cylinder', center=0,0,3, radius=4, height=4, velocity=0,0,70 /
&checkpoint every_steps=9 /
&output directory='flight', formats='hdf5', every=0.25 /
"""


def again(name):
    """A run that goes on from its last checkpoint but one has the same bits."""
    shutil.copytree(name, f"{name}_again")
    checkpoints = sorted(Path(f"{name}_again").glob("checkpoint_*.h5"))
    checkpoints[-1].unlink()
    done = subprocess.run(
        [os.environ["GIMP3D"], "--restart", f"{name}_again"], capture_output=True, text=True, timeout=60
    )
    require(f"{name}: goes on", done.returncode == 0 and checkpoints[0].name in done.stdout)
    same_bits(name, f"{name}_again")
    for file in Path(name).glob("*.dat"):
        if file.name != "cost.dat":
            require(
                f"{name}: {file.name}", file.read_bytes() == Path(f"{name}_again", file.name).read_bytes()
            )


def restart():
    """From the last checkpoint but one: the same bits, of rings that split and merge and of implicit steps
    of material that creeps. Displacements are where particles are less where they began."""
    for name, text in (("flight", FLIGHT), ("creep", CREEP)):
        run(text, 1)
        again(name)
    first, last = snapshots("creep")
    order = [np.argsort(one.ids) for one in (first, last)]
    moved = last["position"][order[1]] - first["position"][order[0]]
    check("displacements", (last["displacement"][order[1]] - moved) / np.abs(moved).max(), 1e-9)


def section_of(scene):
    return subprocess.run(
        [os.environ["GIMP3D"], "--section"], input=scene, capture_output=True, text=True, timeout=60
    )


def conversion():
    """`gimp3d --section` writes a scene's section: the same cells, loads and masses those of the whole."""
    pushed = "times=0,1e-8, loads=0,1e-3, mass=1e-12 /"
    demo = replace((ROOT / "input/demo.nml").read_text(), "out/demo", "demo")
    demo = replace(demo, "times=0,1e-8, speeds=0,20, penetration_factor=0.5 /", pushed)
    slab = SLICE.format(geometry="3d", effects=WEDGE, flying="", end=0.02, name="slab")
    slab = replace(replace(slab, "times=0,1e-3, speeds=0,60 /", pushed), "10,1,10", "10,4,10")
    slab = replace(slab, "8,1,8", "8,4,8")
    for name, text, word, factor in (("demo", demo, "axisymmetric", 4), ("slab", slab, "plane_strain", 0.25)):
        done = section_of(text)
        require(f"{name}: has a section", done.returncode == 0 and done.stderr == "")
        before, after = Scene(text).values(), Scene(done.stdout).values()
        grid, tool = after["grid"][0], after["tool"][0]
        kept = [before["grid"][0]["upper"][0], grid["cell_size"][0], before["grid"][0]["upper"][2]]
        require(
            f"{name}: {word}", grid["geometry"] == [word] and np.allclose(grid["upper"], kept, rtol=1e-12)
        )
        check(f"{name}: load of the whole", tool["loads"][1] / (factor * 1e-3) - 1, 1e-12)
        check(f"{name}: mass of the whole", tool["mass"][0] / (factor * 1e-12) - 1, 1e-12)
        said = subprocess.run(
            [os.environ["GIMP3D"], "--plan"], input=done.stdout, capture_output=True, text=True
        )
        require(f"{name}: the section is a scene", said.returncode == 0)
    for name in ("rolling", "taylor", "spheres", "press_fit"):
        done = section_of((ROOT / f"input/{name}.nml").read_text())
        require(f"{name}: has a section {done.stderr.strip()}", done.returncode == 0)
        probes = Scene(done.stdout).values().get("probe", [])
        require(f"{name}: probes are in it", all(probe["position"][1] == 0 for probe in probes))
    post = (
        "&scene end_time=1e-3 /\n&grid lower={lower}, upper=1.2,1.2,1.6, cell_size=0.1, boundary={sides} /\n"
        "&material name='m', model='elastic', density=1000, young=1e6, poisson=0.3 /\n"
        "&body material='m', shape={shape}, {body} /\n{more}&output directory='post' /\n"
    )
    quarter = {"lower": "0,0,0", "sides": "'symmetry','free','symmetry','free','roller','free'"}
    whole = {"lower": "-1.2,-1.2,0", "sides": "4*'free','roller','free'"}
    slice_of = {"lower": "-1.2,0,0", "sides": "2*'free',2*'symmetry','roller','free'"}
    shape = "'cylinder', center=0,0,0, radius=0.8, height=1"
    round_one = {"shape": shape, "body": "velocity=0,0,1", "more": ""}
    square = "&pressure lower=0,0,1, upper=0.5,0.5,1, times=0, values=1e3 /\n"
    half = {"shape": "'box', lower=-0.6,0,0, upper=0.6,1.2,0.6", "body": "velocity=0,0,1"}
    half["more"] = "&pressure lower=-0.2,0,0.6, upper=0.2,0.6,0.6, times=0, values=1e3 /\n"
    done = section_of(post.format(**quarter, **round_one))
    require("no direction across: has a section", done.returncode == 0)
    flat = post.format(lower="0,0", sides="", shape=round_one["shape"], body="velocity=0,0,1", more="")
    flat = replace(flat, "1.2,1.2,1.6, cell_size=0.1, boundary=", "1.2,1.6, cell_size=0.1,\n")
    flat = replace(flat, "&grid", "&grid geometry='plane_strain',")
    flat = replace(flat, round_one["shape"], "'box', lower=0.2,0,0.2, upper=0.6,1,0.6")
    done = subprocess.run([os.environ["GIMP3D"], "--plan"], input=flat, capture_output=True, text=True)
    require(f"sides left out are free, and mirrors in y {done.stderr.strip()}", done.returncode == 0)
    for text, words in (
        (post.format(**quarter, **round_one | {"more": square}), "no part of a body of revolution"),
        (post.format(**slice_of, **half), "must go from side to side in y"),
        (post.format(**whole, **round_one | {"body": "velocity=1,0,0"}), "a direction across the axis"),
        (post.format(**quarter, **round_one | {"body": "stress=1e3,5*0"}), "a direction across the axis"),
        ((ROOT / "input/indenter.nml").read_text(), "a box is no body of revolution"),
        ((ROOT / "input/vickers.nml").read_text(), "body of revolution"),
        (FLIGHT, "already"),
        (replace(slab, "8,4,8", "8,1,8"), "must go from side to side"),
    ):
        done = section_of(text)
        require(f"no section: {words}", done.returncode == 2 and words in done.stderr and done.stdout == "")


def cut_by_a_box():
    """A box that is cut out of a ball is a ring: nothing of the ball is left beyond the axis, where a tool would
    start inside it."""
    text = SPHERE.format(cell=1e-6, levels="", more="", name="half")
    text = replace(
        text,
        "shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6",
        "shape='sphere', center=0,0,12e-6, radius=10e-6",
    )
    text = replace(
        text, "&tool", "&cut body='body1', shape='box', lower=0,0,12e-6, upper=11e-6,1e-6,23e-6 /\n&tool"
    )
    text = replace(
        text, "shape='sphere', radius=10e-6, tip=0,0,20e-6", "shape='flat', radius=11e-6, tip=0,0,12e-6"
    )
    done = subprocess.run([os.environ["GIMP3D"], "--plan"], input=text, capture_output=True, text=True)
    require(f"a ball cut by a box: {done.stderr.strip()}", done.returncode == 0)


def without_y():
    """Two and four values of &grid are three and six without y."""
    short = replace(FLIGHT, "end_time=0.25", "end_time=0.05")
    six = replace(short, "lower=0,0, upper=14,30", "lower=0,0,0, upper=14,1,30")
    six = replace(
        six, "'symmetry','free','free','free'", "'symmetry','free','symmetry','symmetry','free','free'"
    )
    for text, name in ((short, "four"), (six, "six")):
        run(replace(text, "directory='flight'", f"directory='{name}'"), 1)
    same_bits("four", "six")


BALL = """&scene title='ball', end_time=0.15 /
&grid geometry='axisymmetric', lower=0,0, upper=14,30, cell_size=1, boundary='symmetry','free','free','free' /
{levels}&material name='m', model='neo_hookean', density=1, young=1e4, poisson=0.3 /
&body material='m', shape='cylinder', center=0,0,3, radius=4, height=4, velocity=0,0,70 /
&output directory='{name}', formats='hdf5', every=0.15 /
"""
SPHERE = """&scene title='sphere', end_time=3e-8 /
&grid geometry='axisymmetric', lower=0,0, upper=24e-6,24e-6, cell_size={cell}, boundary='symmetry','free','roller','free' /
{levels}&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='cylinder', center=0,0,0, radius=20e-6, height=20e-6 /
&tool name='sphere', shape='sphere', radius=10e-6, tip=0,0,20e-6, times=0,1e-8, speeds=0,20 /
{more}&output directory='{name}', formats='hdf5', every=3e-8 /
"""


def mean_load(name):
    """Over the second half of the depth, N."""
    rows = History(f"{name}/tool_sphere.dat")
    return np.interp(np.linspace(0.25e-6, 0.39e-6, 50), rows["depth"], rows["load_z"]).mean()


def placed_levels():
    """Levels that are balls have the cells of boxes that cover them, to the bit; levels by a criterion the load
    of a grid that is as fine everywhere, and go on from a checkpoint to the bit."""
    run(BALL.format(levels="&level shape='sphere', center=0,0,14, radius=6 /\n", name="ball"), 1)
    boxes = "".join(
        f"&level of=1, lower=0,0,{14 - high}, upper={wide},1,{14 + high} /\n"
        for wide, high in ((4, 6), (5, 5), (6, 4))
    )
    run(BALL.format(levels=boxes, name="boxes"), 1)
    same_bits("ball", "boxes")
    fine = 0.5e-6
    run(SPHERE.format(cell=fine, levels="", more="", name="fine"), 1)
    run(SPHERE.format(cell=4 * fine, levels="", more="", name="coarse"), 1)
    by_error = "&level criterion='error', max_cells=4000 /\n"
    for name, levels, cell in (
        ("error", 2 * by_error, 4 * fine),
        (
            "stress",
            "&level lower=0,0,16e-6, upper=8e-6,0,24e-6, criterion='stress', max_cells=1000 /\n",
            2 * fine,
        ),
        ("follows", "&level shape='sphere', radius=7e-6, follow='sphere' /\n", 2 * fine),
    ):
        more = "&checkpoint every_steps=4 /\n" if name == "error" else ""
        said = run(SPHERE.format(cell=cell, levels=levels, more=more, name=name), 1)
        off = mean_load(name) / mean_load("fine") - 1
        check(f"levels, {name}: load over that of a fine grid, off 1", off, 0.01)
        require(f"levels, {name}: as quick as they are few", said.figures["particles_at_start"] < 7000)
    require(
        "control: the coarse grid is off by more", abs(mean_load("coarse") / mean_load("fine") - 1) > 0.01
    )
    again("error")


slices()
users_law()
restart()
placed_levels()
conversion()
cut_by_a_box()
without_y()
finish()
