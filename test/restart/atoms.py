"""A tool that presses a box of atoms, stopped by a signal and taken up again, to the bit; and the files of
atoms, read by VTK and as a dump."""

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader
from restarts import *
from gimp3d.run_data import History

ARGON = """style='lj/smooth/linear', epsilon=1.65e-21, sigma=3.405e-10, cutoff=8.5e-10, lattice='fcc',
   constant=5.27e-10"""
END = 6e-12


def text(directory, a, checkpoint=None, moves="relaxation='quench'", end=END):
    def edges(*numbers):
        return ",".join(f"{n * a:.12g}" for n in numbers)

    return scene(
        f"""
&scene title='a sphere on argon', end_time={{end}} /
&grid lower=0,0,0, upper={edges(16, 16, 24)}, cell_size={4 * a:.12g},
      boundary='roller','roller','roller','roller','roller','free' /
&material name='m', model='cauchy_born', density=1814, {ARGON} /
&body material='m', shape='box', lower=0,0,0, upper={edges(16, 16, 16)} /
&atoms lower={edges(4, 4, 12)}, upper={edges(12, 12, 16)}, step=1e-14, mass=6.6335e-26,
       {moves}, {ARGON} /
&tool name='ball', shape='sphere', radius=3e-9, tip={edges(8, 8, 16)}, axis=0,0,-1, times=0, speeds=20 /
""",
        directory,
        checkpoint,
        end=end,
        every=end,
        history=0.0,
    )


answer = run(1, text("none", 5.3e-10), expect=2)
if "LAMMPS cannot be opened" in answer:
    print("  left out, LAMMPS is not there: a box of atoms that is taken up again")
    finish()
constant = float(re.search(r"constants of the lattice \(([0-9.e+-]+) m\)", answer).group(1))
without = text("hidden", constant).replace("step=1e-14", "library='liblammps_hidden.so', step=1e-14")
hidden = run(1, without, expect=2)
require(
    f"without LAMMPS one sentence: {said(hidden)}",
    "&atoms: LAMMPS cannot be opened" in said(hidden) and "make deps ATOMS=yes" in said(hidden),
)
require("and nothing is written", not Path("hidden").exists())
angles = "style='tersoff', potential='Si.tersoff', element='Si'"
other = run(1, text("other", constant).replace(ARGON, angles), expect=2)
require(f"what a potential of angles lacks is said: {said(other)}", "no force of its own" in said(other))
run(1, text("whole", constant))
status, output = part_run(1, "stopped", text("stopped", constant, "every_steps=5"))
require(f"stopped by a signal at step {newest_step('stopped')}, status {status}", status == 5)
require("within the run", 0 < newest_step("stopped") < 15)
run(1, restart="stopped")
same("taken up", "whole", "stopped")
one, other = (everything(sorted(Path(name).glob("atoms_*.hdf"))[-1]) for name in ("whole", "stopped"))
require(
    "places and velocities of atoms have the same bits",
    all(
        one[key].tobytes() == other[key].tobytes() for key in ("VTKHDF/Points", "VTKHDF/PointData/velocity")
    ),
)
WARM = {"moves": "temperature=20, thermostat_rate=2e12", "end": 0.3 * END}
run(1, text("warm", constant, **WARM))
status, output = part_run(1, "warm_stopped", text("warm_stopped", constant, "every_steps=2", **WARM))
require(f"with a thermostat stopped at step {newest_step('warm_stopped')}, status {status}", status == 5)
run(1, restart="warm_stopped")
same("with a thermostat, taken up", "warm", "warm_stopped")
run(2, text("warm_two", constant, **WARM))
warm, two = (History(Path(name) / "atoms_atoms.dat") for name in ("warm", "warm_two"))
apart = abs(warm["temperature"][-1] / two["temperature"][-1] - 1)
require(f"on two ranks the temperature is the same but for {apart:.1e}", apart < 1e-9)
one_load, two_load = (History(Path(n) / "tool_ball.dat")["load_z"][-1] for n in ("warm", "warm_two"))
require("and the load", abs(one_load / two_load - 1) < 1e-9)

rows = History(Path("whole") / "atoms_atoms.dat")
load = History(Path("whole") / "tool_ball.dat")["load_z"]
require(f"the tool is pushed, {load[-1]:.3g} N", load[-1] > 0)
require("it works on the atoms", rows["work_of_tools"][-1] > 0)

path = sorted(Path("whole").glob("atoms_*.hdf"))[-1]
reader = vtkHDFReader()
reader.SetFileName(str(path))
reader.Update()
mesh = reader.GetOutput()
points = vtk_to_numpy(mesh.GetPoints().GetData())


def field(name):
    return vtk_to_numpy(mesh.GetPointData().GetArray(name))


require("VTK reads as many atoms", len(points) == len(one["VTKHDF/Points"]))
real = field("type") == 1
require("atoms and pads", set(np.unique(field("type"))) == {1.0, 2.0} and np.sum(real) == 8 * 8 * 4 * 4)
require("most atoms are of the fcc class", np.mean(field("structure")[real] == 1) > 0.5)
deep = real & (points[:, 2] < 14 * constant)
require("atoms under the tool are pressed", field("stress")[deep][:, 2].mean() < 0)

dump = max(Path("whole").glob("*.lammpstrj"), key=lambda path: path.stat().st_mtime)
require("a dump has the step of its snapshot, in 8 digits", dump.with_suffix(".hdf").is_file(), dump)
lines = dump.read_text().splitlines()
count = int(lines[3])
first = next(n for n, line in enumerate(lines) if line.startswith("ITEM: ATOMS id type x y z vx vy vz"))
table = np.array([row.split() for row in lines[first + 1 :]], dtype=float)
require("the dump has the same atoms", len(table) == count == len(points))
require(
    "at the same places", np.abs(table[:, 2:5] * 1e-10 - points).max() < 1e-9 * np.abs(points).max()
)
finish()
