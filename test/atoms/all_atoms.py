"""Coupled models against atoms alone (LAMMPS, the same potential): copper of Mishin et al., 0 K, equilibrium.

void     a cube of 32 constants with a void of 1 nm, flattened by 0.5 % (mirror planes all around): displacements
sphere   a rigid sphere of 2.5 nm on 28 x 28 x 24 constants: loads at some depths; depth, load and kind of the
         first defect, with a picture (sphere_defect.png)

   all_atoms.py [void] [sphere]

Needs `lmp` beside the library. Time of the processor and memory of both are printed."""

import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.spatial import cKDTree

from checks import finish, require
from gimp3d.atoms_section import AtomsSection
from gimp3d.run_data import History, Particles, time_of_snapshot

A = 3.614925e-10  # constant of the potential, m
COPPER = "potential='Cu_mishin1.eam.alloy', element='Cu'"
FILE = "/usr/share/lammps/potentials/Cu_mishin1.eam.alloy"
NANO = 1.602176634  # eV/angstrom in nN
LONG, SHORT = (0.08, 0.16, 0.24, 0.28), (0.30, 0.31, 0.32, 0.33, 0.34, 0.35, 0.36)  # depths, nm
WAY, HOLDS = 0.8e-12, (4e-12, 1.6e-12)  # motion to each, and holds there, s
OFF = (0.13, 0.07)  # of the tip, from a place between atoms that is symmetric, in constants
STIFFNESS = 16.9829e12  # of the tip, N/m2
DEFECTS = 12  # atoms of hcp order that count as a defect

START = """units metal
boundary {boundary}
atom_modify map array
lattice fcc {a} origin 0.25 0.25 0.25
region all block 0 {nx} 0 {nx} 0 {nz}
create_box 1 all
create_atoms 1 region all
pair_style eam/alloy
pair_coeff * * {file} Cu
neighbor 1.0 bin
neigh_modify every 1 delay 0 check yes
min_style cg
min_modify dmax 0.05
"""

VOID = """region void sphere {m} {m} {m} 10.0 units box
delete_atoms region void compress no
write_dump all custom first.lammpstrj id type x y z modify sort id format float %.10g
change_box all z final 0 {lz} remap units box
minimize 0 1e-6 1000 3000
write_dump all custom last.lammpstrj id type x y z modify sort id format float %.10g
"""

SPHERE = """compute pe all pe/atom
compute cna all cna/atom {cna}
compute stress all stress/atom NULL
region bottom block INF INF INF INF INF 1.5
group bottom region bottom
fix hold bottom setforce NULL NULL 0.0
minimize 0 1e-3 500 1000
variable depth equal 0.0
variable height equal {top}+25.0-v_depth
variable radius equal 25.0+{a}/4
fix tip all indent {stiffness} sphere {x} {y} v_height ${{radius}} units box
fix_modify tip energy yes
thermo_style custom step pe f_tip[3]
variable load equal f_tip[3]
variable list index {depths}
label next
variable depth equal ${{list}}
minimize 0 2e-3 1000 2000
dump d all custom 1 depth_${{list}}.lammpstrj id type x y z c_cna c_stress[3]
dump_modify d sort id format float %.8g
run 0 post no
undump d
print "$(v_depth/10) $(v_load)" append curve.txt
next list
jump SELF next
"""


def numbers(*values):
    return ",".join(repr(float(v)) for v in values)


def run(command, text, where):
    """Run with input from a file (lmp) or from standard input; seconds of the processor and memory (MB)."""
    where.mkdir(exist_ok=True)
    (where / "in.run").write_text(text)
    with open(where / "in.run") as given, open(where / "out.txt", "w") as out:
        child = subprocess.Popen(command, stdin=given, stdout=out, stderr=subprocess.STDOUT, cwd=where)
        _, status, usage = os.wait4(child.pid, 0)
    if status:
        print("\n".join((where / "out.txt").read_text().splitlines()[-5:]))
    require(f"{where.name}: status {status}", status == 0)
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def dump(path):
    """Columns of a dump by name."""
    head, body = path.read_text().split("ITEM: ATOMS", 1)
    names, rows = body.split("\n", 1)
    values = np.array(rows.split(), float).reshape(-1, len(names.split()))
    return dict(zip(names.split(), values.T))


def places(columns):
    return 1e-10 * np.stack([columns[c] for c in "xyz"], axis=1)


def snapshot_of(path):
    """The file for ParaView that was written with a dump."""
    return path.with_name(f"atoms_atoms_{int(path.stem.split('_')[-1]):08d}.hdf")


def dumps_of(directory):
    return sorted(directory.glob("atoms_atoms_*.lammpstrj"), key=lambda p: int(p.stem.split("_")[-1]))


def say_prices(atoms, coupled, all_atoms, box_atoms):
    print(
        f"  all atoms: {all_atoms}, {atoms[0]:.0f} s of the processor, {atoms[1]:.0f} MB; coupled: "
        f"{box_atoms} ({all_atoms / box_atoms:.1f} times fewer), {coupled[0]:.0f} s, {coupled[1]:.0f} MB"
    )


def void(cells=1):
    """`cells`: of the grid, in four constants. Largest difference of displacements in the box, relative to the
    largest displacement, and of what the void adds to the uniform strain, relative to the largest of that."""
    n, m, a = 32 * A, 16 * A, 1e10 * A
    text = START.format(boundary="p p p", a=a, nx=32, nz=32, file=FILE)
    text += VOID.format(m=16 * a, lz=repr(32 * a * 0.995))
    atoms = run(["lmp", "-in", "in.run", "-log", "none"], text, Path("void_atoms"))
    cell = 4 * A * cells
    scene = f"""&scene title='void', end_time=12e-12 /
&grid lower=0,0,0, upper={numbers(n, n, n + 2 * cell)}, cell_size={cell!r},
      boundary='roller','roller','roller','roller','roller','free' /
&material name='copper', model='cauchy_born', density=8936, {COPPER} /
&body material='copper', shape='box', lower=0,0,0, upper={numbers(n, n, n)} /
&contact subcell=0 /
&damping kind='viscous', coefficient=1.1e12 /
&tool name='plate', shape='flat', radius=1e-6, tip={numbers(m, m, n)}, axis=0,0,-1,
      times=0,0.5e-12,1.5e-12,2e-12, speeds={numbers(0, 0.005 * n / 1.5e-12, 0.005 * n / 1.5e-12, 0)} /
&atoms {COPPER}, lower={numbers(*3 * [10 * A])}, upper={numbers(*3 * [22 * A])},
       void_center={numbers(m, m, m)}, void_radius=1e-9, relaxation='quench', step=5e-15 /
&output directory='out', every=12e-12, history_every=1e-12 /
"""
    coupled = run([os.environ["GIMP3D"]], scene, Path("void_coupled"))
    first, last = (places(dump(Path("void_atoms") / f"{name}.lammpstrj")) for name in ("first", "last"))
    size = n * np.array([1, 1, 0.995])
    uniform = first * [1, 1, 0.995]
    there = (last - uniform + size / 2) % size - size / 2
    files = dumps_of(Path("void_coupled/out"))
    before, after = dump(files[0]), dump(files[-1])
    real = before["type"] == 1
    x, y = places(before)[real], places(after)[real]
    off, row = cKDTree(first).query(x)
    require("the same lattice", off.max() < 1e-13)
    here, there = y - x * [1, 1, 0.995], there[row]
    apart = np.linalg.norm(here - there, axis=1).max()
    whole = np.linalg.norm(there + x * [0, 0, -0.005], axis=1).max()
    own = np.linalg.norm(there, axis=1).max()
    print(
        f"  void: displacements differ by {100 * apart / whole:.2f} % of the largest in the box, by "
        f"{100 * apart / own:.2f} % of the largest that the void adds"
    )
    say_prices(atoms, coupled, len(first), len(x))
    require("void: within 2 % of the largest", apart < 0.02 * whole)


def stacked(columns, top):
    """Atoms of hcp order, not those of the surfaces."""
    inside = (columns["z"] > 4.0) & (columns["z"] < top - 3.0)
    return inside & (np.round(columns["c_cna"]) == 2)


def defect_picture(atoms, path, top, middle):
    """All atoms and the box of the coupled model: planes of atoms through the stacking fault of each."""
    volume = (1e10 * A) ** 3 / 4
    box = Particles(path)
    real = np.round(box["type"].reshape(-1)) == 1
    both = [
        (
            "all atoms",
            {
                "position": places(atoms),
                "type": atoms["type"],
                "structure": np.round(atoms["c_cna"]),
                "stress": 1e5 * np.outer(atoms["c_stress[3]"] / volume, [0, 0, 1, 0, 0, 0]),
            },
        ),
        ("atoms in particles", {k: box[k][real] for k in ("position", "type", "structure", "stress")}),
    ]
    figure, axes = plt.subplots(1, 2, figsize=(8, 3.6), sharey=True, layout="constrained")
    for ax, (title, of) in zip(axes, both):
        z = of["position"][:, 2]
        fault = (np.round(of["structure"].reshape(-1)) == 2) & (z < 1e-10 * (top - 3)) & (z > 4e-10)
        plane = np.median(of["position"][fault, 1]) if fault.any() else middle
        section = AtomsSection(of, 0, 2, 1, plane)
        like = ax.scatter([], [], c=[], vmin=-20, vmax=5, cmap="viridis")
        section.draw(ax, section.stress[:, 2], like, 1e-9, 1e9)
        ax.set(
            title=title,
            aspect="equal",
            xlim=1e9 * middle + np.array([-2.4, 2.4]),
            ylim=1e-1 * top + np.array([-3.0, 0.3]),
            xlabel="x [nm]",
        )
    axes[0].set_ylabel("z [nm]")
    figure.colorbar(like, ax=axes, label="stress zz [GPa]")
    figure.savefig("sphere_defect.png", dpi=110)


def sphere_scene(ends):
    """The coupled scene; the ends of its holds are put into a list."""
    times, speeds, t, depth = [0.0], [0.0], 0.0, 0.0
    for d in LONG + SHORT:
        hold = HOLDS[d in SHORT]
        times += [t + WAY / 2, t + WAY, t + WAY + hold]
        speeds += [2e-9 * (d - depth) / WAY, 0.0, 0.0]
        t, depth = times[-1], d
        ends.append(t)
    n, z, low = 28 * A, 24 * A, 8 * A
    return f"""&scene title='sphere', end_time={t!r} /
&grid lower=0,0,0, upper={numbers(n, n, z + 8 * A)}, cell_size={2 * A!r},
      boundary='roller','roller','roller','roller','roller','free' /
&material name='copper', model='cauchy_born', density=8936, {COPPER} /
&body material='copper', shape='box', lower=0,0,0, upper={numbers(n, n, z)} /
&damping kind='viscous', coefficient=1e12 /
&tool name='sphere', shape='sphere', radius=2.5e-9, tip={numbers(n / 2 + OFF[0] * A, n / 2 + OFF[1] * A, z)},
      axis=0,0,-1, times={numbers(*times)},
      speeds={numbers(*speeds)} /
&atoms {COPPER}, lower={numbers(low, low, z - 10 * A)}, upper={numbers(n - low, n - low, z)},
       tool_stiffness={STIFFNESS!r}, relaxation='quench', step=1e-14, at_interface='go_on' /
&output directory='out', every={WAY + HOLDS[1]!r}, history_every=1e-13 /
"""


def sphere():
    """Loads at depths before the first defect, and where that comes."""
    a, top, depths, ends = 1e10 * A, 24e10 * A, LONG + SHORT, []
    text = START.format(boundary="p p s", a=a, nx=28, nz=24, file=FILE) + SPHERE.format(
        cna=0.25 * (np.sqrt(2) + 2) * a,
        top=top,
        a=a,
        x=(14 + OFF[0]) * a,
        y=(14 + OFF[1]) * a,
        stiffness=STIFFNESS / 1.602176634e11,
        depths=" ".join(f"{10 * d:.1f}" for d in depths),
    )
    atoms = run(["lmp", "-in", "in.run", "-log", "none"], text, Path("sphere_atoms"))
    coupled = run([os.environ["GIMP3D"]], sphere_scene(ends), Path("sphere_coupled"))
    theirs = NANO * np.loadtxt("sphere_atoms/curve.txt")[:, 1]
    tool = History(Path("sphere_coupled/out/tool_sphere.dat"))
    snapshots = {time_of_snapshot(snapshot_of(p)): p for p in dumps_of(Path("sphere_coupled/out"))}
    ours, first = [], {}
    for k, (d, end) in enumerate(zip(depths, ends)):
        row = np.flatnonzero(tool["time"] <= 1.0001 * end)[-1]
        ours.append(1e9 * tool["load_z"][row])
        all_of_them = dump(Path(f"sphere_atoms/depth_{10 * d:.1f}.lammpstrj"))
        path = min(snapshots.items(), key=lambda item: abs(item[0] - end))[1]
        box = dump(path)
        counts = [int(stacked(of, top)[of["type"] < 1.5].sum()) for of in (all_of_them, box)]
        print(
            f"  sphere, {d:.2f} nm: all atoms {theirs[k]:.2f} nN, {counts[0]} hcp; coupled {ours[k]:.2f} nN "
            f"({100 * (ours[k] / theirs[k] - 1):+.1f} %), {counts[1]} hcp"
        )
        for name, count, of in (("all", counts[0], all_of_them), ("coupled", counts[1], path)):
            if count >= DEFECTS and name not in first:
                first[name] = (k, of)
    require("both have a defect in the end", len(first) == 2)
    if len(first) < 2:
        return
    before = min(first[name][0] for name in first)
    worst = max(abs(ours[k] / theirs[k] - 1) for k in range(before))
    depth = [depths[first[name][0]] for name in ("all", "coupled")]
    load = [loads[first[name][0] - 1] for name, loads in (("all", theirs), ("coupled", ours))]
    print(
        f"  first defect: all atoms at {depth[0]:.2f} nm, after {load[0]:.2f} nN; coupled at {depth[1]:.2f} "
        f"nm, after {load[1]:.2f} nN"
    )
    defect_picture(first["all"][1], snapshot_of(first["coupled"][1]), top, 14 * A)
    say_prices(atoms, coupled, len(all_of_them["x"]), int((box["type"] == 1).sum()))
    require(f"sphere: loads before the first defect within 2 %: {100 * worst:.1f}", worst < 0.02)
    require("depth of the first defect within 5 %", abs(depth[1] / depth[0] - 1) < 0.05)
    require("load of the first defect within 5 %", abs(load[1] / load[0] - 1) < 0.05)


if not shutil.which("lmp") or not Path(FILE).is_file():
    print("  left out, lmp or its potentials are not there: coupled models against atoms alone")
else:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for name in sys.argv[1:] or ["void", "sphere"]:
        {"void": void, "sphere": sphere}[name]()
finish()
