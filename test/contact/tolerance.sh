#!/bin/bash
#test: limit 60
# A sphere pressed into a small block: however tight the tolerance, contact is solved, with hardly more products, and the load is as
# near to that of the tightest as ten times the tolerance.
. "$(dirname "$0")/../harness/env.sh"
for tolerance in 1e-6 1e-8 1e-10 1e-12; do
   cat >t.nml <<END
&scene    title='tolerance', end_time=1e-9 /
&grid     lower=0,0,0, upper=2.304e-6,2.304e-6,1.536e-6, cell_size=192e-9,
          boundary='symmetry','free','symmetry','free','roller','free' /
&time     time_step=3e-12 /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body     material='aluminium', shape='box', lower=0,0,0, upper=1.92e-6,1.92e-6,0.96e-6, particles_per_cell=8 /
&tool     name='ball', shape='sphere', radius=1e-6, tip=0,0,0.96e-6, axis=0,0,-1, times=0,2e-10, speeds=0,150 /
&contact  tolerance=$tolerance /
&output   directory='$tolerance', formats='none' /
END
   run_scene 2 t.nml || { cat run_2.log; fail "tolerance $tolerance"; }
   cp run_2.log $tolerance.log
done
"$PYTHON" - <<'END'
import re
from runs import *

loads, products = {}, {}
for tolerance in ("1e-6", "1e-8", "1e-10", "1e-12"):
    log = Path(f"{tolerance}.log").read_text()
    products[tolerance] = float(re.search(r"iterations and (\S+) products each", log)[1])
    residual, above = re.search(r"largest residual (\S+) \(relative\), (\d+) steps above the tolerance", log).groups()
    print(f"   tolerance {tolerance}: {products[tolerance]} products a solve, largest residual {residual}")
    require(f"{tolerance}: every step comes below the tolerance", int(above) == 0 and float(residual) <= float(tolerance))
    loads[tolerance] = History(Path(tolerance) / "tool_ball.dat")["load_z"]
require("there is a load", max(abs(loads["1e-12"])) > 1e-4)
for tolerance, bar in (("1e-6", 1e-5), ("1e-8", 1e-7), ("1e-10", 1e-9)):
    off = max(abs(loads[tolerance] - loads["1e-12"]))/max(abs(loads["1e-12"]))
    check(f"{tolerance}: load against that of 1e-12, of the largest", off, bar)
require("1e-12 takes at most three times the products of 1e-6", products["1e-12"] <= 3*products["1e-6"])
finish()
END
