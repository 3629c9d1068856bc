#!/bin/bash
#test: limit 60
# A bar in uniaxial strain hits a wall: the stress behind the front is rho c v. With bulk viscosity the ringing behind the front is less,
# the stress is right, and what the viscosity takes closes the energy balance.
. "$(dirname "$0")/../harness/env.sh"
for name in without with; do
   cat >$name.nml <<END
&scene    title='shock', end_time=1.2e-5 /
&grid     lower=0,0,0, upper=0.128,4e-3,4e-3, cell_size=1e-3,
          boundary='symmetry','free','symmetry','symmetry','symmetry','symmetry' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body     material='aluminium', shape='box', lower=0,0,0, upper=0.1,4e-3,4e-3, particles_per_cell=8, velocity=-10,0,0 /
&probe    name='middle', position=0.0302,1.2e-3,1.2e-3 /
&output   directory='$name', formats='none' /
END
done
echo '&bulk_viscosity linear=0.2, quadratic=1.2 /' >>with.nml
for name in without with; do
   run_scene 2 $name.nml || { cat run_2.log; fail "$name"; }
done
"$PYTHON" - <<'END'
from runs import *

young, poisson, density = 70e9, 0.33, 2710.0
modulus = young*(1 - poisson)/((1 + poisson)*(1 - 2*poisson))
exact = 10*np.sqrt(modulus*density)
ringing = {}
for name in ("without", "with"):
    history = History(Path(name) / "probe_middle.dat")
    behind = history["time"] > 8e-6
    stress = -history["stress_xx"][behind]/exact
    ringing[name] = np.std(stress)
    print(f"   {name} viscosity: stress behind the front over rho c v {np.mean(stress):.4f}, ringing {ringing[name]:.4f} rms")
    check(f"{name}: mean stress behind the front over rho c v", np.mean(stress) - 1, 0.01)
    rows = energy(name)
    check(f"{name}: energy balance at the end", rows["balance_error"][-1], 0.02)
    damped = rows["damped"][-1]/rows["kinetic"][0]
    print(f"   {name} viscosity: damped {100*damped:.2f} % of the first energy")
    require(f"{name}: energy is damped where there is viscosity", (damped > 1e-3) == (name == "with"))
require("viscosity takes half of the ringing", ringing["with"] < 0.5*ringing["without"])
finish()
END
