#!/bin/bash
#test: long
#test: limit 120
# Where the face of a body stands in its cell must not matter: a damped block at rest on a floor that lies on a node plane, a little above and
# below it; the stress of its first layers; and the momentum that tools give a block that they have squeezed.
. "$(dirname "$0")/../harness/env.sh"
rest() { # rest NAME FLOOR FACTOR PARTICLES END
   cat <<END
&scene title='$1', end_time=$5 /
&grid lower=0,0,0, upper=0.4,0.4,0.3, cell_size=0.025 /
&material name='rubber', model='elastic', density=1000, young=4e6, poisson=0 /
&body material='rubber', shape='box', lower=0.1,0.1,$2, upper=0.3,0.3,$("$PYTHON" -c "print($2 + 0.1)"), particles_per_cell=$4 /
&gravity acceleration=0,0,-9.81 /
&tool name='floor', shape='flat', radius=10, tip=0.2,0.2,$2, axis=0,0,1, times=0, speeds=0, penetration_factor=$3 /
&damping kind='viscous', coefficient=200 /
&output directory='$1', every=$5 /
END
}
rest on_plane 0.1 0.5 8 0.6 >on_plane.nml
rest above 0.10125 0.4 8 0.2 >above.nml
rest below 0.09875 0.4 8 0.2 >below.nml
rest middle 0.1125 0.4 8 0.2 >middle.nml
rest at_plane 0.1 0.4 8 0.2 >at_plane.nml
cat >squeezed.nml <<END
&scene title='squeezed and pushed aside', end_time=0.9 /
&grid lower=0,0,0, upper=24,20,20, cell_size=1 /
&time domain='fixed' /
&material name='r', model='neo_hookean', density=1000, young=2.6e6, poisson=0.45 /
&body material='r', shape='box', lower=8,7,7, upper=14,13,13, particles_per_cell=8 /
&tool name='top', shape='flat', radius=100, tip=11,10,13, axis=0,0,-1, times=0,0.1,0.6,0.7, speeds=0,3,3,0, penetration_factor=0.5 /
&tool name='low', shape='flat', radius=100, tip=11,10,7, axis=0,0,1, times=0,0.1,0.6,0.7, speeds=0,3,3,0, penetration_factor=0.5 /
&tool name='side', shape='flat', radius=100, tip=7.5,10,10, axis=1,0,0, times=0.5,0.6, speeds=0,4, penetration_factor=0.5 /
&output directory='squeezed' /
END
for name in on_plane above below middle at_plane squeezed; do
   run_scene 1 $name.nml || { cat run_1.log; fail "$name"; }
   cp run_1.log $name.log
done
"$PYTHON" - <<'END'
import re
import h5py
from runs import *

load = History(Path("on_plane/tool_floor.dat"))
late = load["time"] > 0.4
weight = 4*9.81
print(f"   load on a floor on a node plane: {-load['load_z'][late].max():.6f} to {-load['load_z'][late].min():.6f} N; exact {weight:.6f} N")
check("load at rest on a node plane, over the weight", (abs(load["load_z"][late]) / weight - 1), 1e-4)
check("energy balance there", energy("on_plane")["balance_error"], 0.1)
for name, floor in (("above", 0.10125), ("below", 0.09875), ("middle", 0.1125), ("at_plane", 0.1)):
    with h5py.File(max(Path(name).glob("particles_*.hdf"))) as file:
        x, stress = file["VTKHDF/Points"][:], file["VTKHDF/PointData/stress"][:, 2]
    layers = np.array([stress[abs(x[:, 2] - floor - (0.5 + n)*0.0125) < 0.004].mean() for n in range(2)])
    ratio = layers/(-1000*9.81*(0.1 - (np.arange(2) + 0.5)*0.0125))
    print(f"   {name}: stress of the first two layers over the exact one: {ratio[0]:.3f}, {ratio[1]:.3f}")
    check(f"{name}: stress of the first two layers, over the exact one", ratio - 1, 0.1)
# what tools and bodies exchange
history, impulse = energy("squeezed"), 0
off = re.search(r"^momentum: changed by (\S+) kg m/s, tools gave (\S+) kg m/s, off by (\S+) kg m/s, (\S+) %", Path("squeezed.log").read_text(), re.M)
require("the summary says by how much momentum is off", off is not None)
print("   " + off[0])
check("momentum of a squeezed block over the impulse of the tools", float(off[3])/float(off[2]), 1e-12)
finish()
END
