"""A polycrystal on several numbers of ranks, stopped and taken up again, and against one crystal."""

import h5py
from restarts import *
from gimp3d.run_data import History

END = 0.015
CRYSTAL = """
&scene title='a polycrystal that spins and flows', end_time={end} /
&grid lower=0,0,0, upper=2.4,1.6,1.6, cell_size=0.1 /
&level lower=0.6,0.4,0.4, upper=1.4,1.2,1.2 /
&material name='soft', model='crystal', density=1000, c11=1.7e6, c12=1.24e6, c44=0.75e6, reference_rate=1, rate_sensitivity=0.05,
          tau0=1e3, tau_s=6e3, h0=2e4, q=1.4 /
&material name='wood', model='orthotropic', density=1000, young_moduli=2e6,4e5,3e5, poisson_ratios=0.3,0.25,0.4,
          shear_moduli=2e5,2e5,1e5 /
&body material='soft', shape='box', lower=0.5,0.5,0.5, upper=0.7,0.8,0.8, velocity=5,2,1, angular_velocity=0,80,60, {orientation} /
&body material='wood', shape='box', lower=1.6,0.5,0.5, upper=1.8,0.7,0.8, velocity=-3,2,1, angular_velocity=9,8,3,
      orientation=20,30,40 /
{grains}
&probe name='p', position=0.65,0.7,0.7 /
"""


def text(directory, checkpoint=None, grains="", orientation="orientation=0,0,0", end=END):
    filled = CRYSTAL.replace("{grains}", grains).replace("{orientation}", orientation)
    return scene(filled, directory, checkpoint, end=end, every=end / 2)


MANY = "&grains lower=0.5,0.5,0.5, upper=0.7,0.8,0.8, count=6, seed=3 /"
for ranks in (1, 2):
    log = run(ranks, text(f"on_{ranks}", grains=MANY))
    if ranks > 1:
        same(f"{ranks} ranks", "on_1", f"on_{ranks}")
first, last = (
    everything(path) for path in (sorted(Path("on_1").glob("particles_*.hdf"))[i] for i in (0, -1))
)
field = "VTKHDF/PointData/"
soft = last[field + "body"].ravel() == 1
require("particles were split", len(last[field + "id"]) > len(first[field + "id"]))
require("on both levels", set(last[field + "level"].ravel()) == {1.0, 2.0})
require("all grains are there", set(first[field + "grain"].ravel()) == set(range(7)))
require("there was flow", np.median(last[field + "slip"].ravel()[soft]) > 0.05)
require("none elsewhere", np.all(last[field + "slip"].ravel()[~soft] == 0))
turned = last[field + "orientation"]
require("orientations are unit quaternions", np.abs(np.linalg.norm(turned, axis=1) - 1).max() < 1e-6)
require("the lattice has turned", np.median(last[field + "lattice_rotation"].ravel()[soft]) > 5)
require("resistances have grown", last[field + "slip_resistance"][soft].min() > 1e3)
require("colours", 0 <= last[field + "ipf_colour"].min() and last[field + "ipf_colour"].max() <= 1)

energy = History(Path("on_1") / "energy.dat")
error = np.abs(energy["balance_error"]).max()
require(f"energy balance error {100 * error:.2f} % of the energy of the start", error < 0.02)
require(
    f"plastic energy {100 * energy['plastic'][-1] / energy['kinetic'][0]:.1f} % of it",
    energy["plastic"][-1] > 0.05 * energy["kinetic"][0],
)
require("plastic energy never falls", np.diff(energy["plastic"]).min() >= 0)

# stopped, and taken up on another number of ranks
part_run(1, "stopped", text("stopped", "every_steps=9", grains=MANY))
require(f"stopped at step {newest_step('stopped')}", newest_step("stopped") > 0)
run(2, restart="stopped")
same("stopped on 1 rank, taken up on 2", "on_1", "stopped")

# grains of one orientation are one crystal; the body's own orientation is what theirs would be
alike = "&grains lower=0.5,0.5,0.5, upper=0.7,0.8,0.8, orientations=" + ",".join(["10,35,20"] * 5) + " /"
run(1, text("alike", grains=alike))
run(1, text("single", orientation="orientation=10,35,20"))
a, b = (everything(sorted(Path(name).glob("particles_*.hdf"))[-1]) for name in ("alike", "single"))
require(
    "no seam: grains of one orientation are one crystal, to the bit",
    all(np.array_equal(a[name], b[name]) for name in b if name.startswith(field) and "@" not in name),
)
require(
    "another orientation gives another answer",
    not np.array_equal(last[field + "stress"], b[field + "stress"]),
)


# three axes in place of three angles, given with twelve digits
def about(axis, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn, one, other = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    turn[one, one], turn[other, other], turn[other, one], turn[one, other] = c, c, s, -s
    return turn


axes = about(2, 10) @ about(0, 35) @ about(2, 20)
run(
    1,
    text(
        "axes",
        orientation="orientation=" + ",".join(f"{value:.12f}" for value in axes.T.ravel()),
        end=END / 10,
    ),
)
run(1, text("angles", orientation="orientation=10,35,20", end=END / 10))
a, b = (everything(sorted(Path(name).glob("particles_*.hdf"))[-1]) for name in ("axes", "angles"))
for name in ("orientation", "stress", "ipf_colour"):
    off = np.abs(a[field + name] - b[field + name]).max() / np.abs(b[field + name]).max()
    require(
        f"axes in place of angles: {name} off by {off:.1e}", off < (1e-5 if name == "ipf_colour" else 1e-9)
    )

# case.nml has what a file of grains says
Path("grains.txt").write_text("# phi1 Phi phi2\n" + "10 35 20 ! a grain\n" * 5)
run(
    1,
    text("by_file", grains="&grains lower=0.5,0.5,0.5, upper=0.7,0.8,0.8, file='grains.txt' /", end=END / 20),
)
Path("grains.txt").unlink()
again = (Path("by_file") / "case.nml").read_text().replace("'by_file'", "'by_case'")
run(1, again)
same("grains of a file, and of the case.nml of that run", "by_file", "by_case")

# a file of HDF5: seeds as in a list; voxels, where grains are what they say, on any number of ranks and after
# a restart
BOX = "&grains lower=0.5,0.5,0.5, upper=0.7,0.8,0.8"
rng = np.random.default_rng(5)
seeds, angles = rng.uniform([0.5, 0.5, 0.5], [0.7, 0.8, 0.8], (6, 3)), rng.uniform(0, 180, (6, 3))
listed = lambda values: ",".join(repr(float(x)) for x in values.ravel())
with h5py.File("seeds.h5", "w") as file:
    file["positions"], file["orientations"] = seeds, angles
run(
    1,
    text(
        "as_list", grains=f"{BOX}, positions={listed(seeds)}, orientations={listed(angles)} /", end=END / 20
    ),
)
run(1, text("as_hdf5", grains=f"{BOX}, file='seeds.h5' /", end=END / 20))
same("grains of a list and of HDF5", "as_list", "as_hdf5")
counts = np.array([4, 6, 7])  # along x, y, z
voxels = rng.integers(0, 7, counts[::-1])
with h5py.File("voxels.h5", "w") as file:
    file["grain"], file["orientations"] = voxels.astype("u2"), angles
for ranks in (1, 2):
    run(ranks, text(f"voxels_{ranks}", "every_steps=9", grains=f"{BOX}, file='voxels.h5' /", end=END / 20))
same("voxels on 2 ranks", "voxels_1", "voxels_2")
start = everything(sorted(Path("voxels_1").glob("particles_*.hdf"))[0])
place, grain = start["VTKHDF/Points"], start[field + "grain"].ravel().astype(int)
inside = np.all((place > [0.5, 0.5, 0.5]) & (place < [0.7, 0.8, 0.8]), axis=1) & (
    start[field + "body"].ravel() == 1
)
at = np.minimum(((place[inside] - 0.5) / np.array([0.2, 0.3, 0.3]) * counts).astype(int), counts - 1)
require(
    f"{inside.sum()} particles have the grain of their voxel",
    inside.sum() > 50
    and np.array_equal(grain[inside], voxels[at[:, 2], at[:, 1], at[:, 0]])
    and not grain[~inside].any(),
)
with h5py.File("voxels.h5", "a") as file:
    file["orientations"][0, 0] += 1
refused = said(run(1, restart="voxels_1", expect=2))
require(
    f"a file that has been changed is refused: {refused}",
    "voxels.h5" in refused and "has been changed" in refused,
)
for name, fault in (
    ("none", "no dataset 'orientations'"),
    ("wide", "of another form"),
    ("beyond", "holds grains 0 to 9; allowed: 0, and 1 to"),
):
    with h5py.File(f"{name}.h5", "w") as file:
        if name != "none":
            file["orientations"] = angles[:, :2] if name == "wide" else angles
        if name == "beyond":
            file["grain"] = np.pad(np.full((1, 1, 1), 9), ((0, 1), (0, 0), (0, 0)))
    refused = said(run(1, text("bad", grains=f"{BOX}, file='{name}.h5' /"), expect=2))
    require(f"refused: {refused}", fault in refused and "line " in refused)
finish()
