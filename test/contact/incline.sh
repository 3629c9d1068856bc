#!/bin/bash
#test: beside
#test: limit 240
# A block on an incline of 25 degrees: it slides as (sin - mu cos) g t^2/2 with mu = 0.3, and sticks with mu = 0.6.
. "$(dirname "$0")/../harness/env.sh"
scene=$ROOT/input/incline.nml
sed "s:out/incline:slides:" "$scene" >slides.nml
sed "s:out/incline:stays:; s/friction=0.3/friction=0.6/; s/end_time=0.3/end_time=0.15/" "$scene" >stays.nml
echo "&damping kind='viscous', coefficient=200 /" >>stays.nml
for name in slides stays; do
   run_scene 1 $name.nml || { cat run_1.log; fail "$name"; }
   grep -q '^guard: no retries' run_1.log || fail "$name: a contact problem was not solved: $(grep '^retry' run_1.log)"
done
"$PYTHON" - <<'END'
import math
from runs import *

angle, g, mass, friction = math.radians(25), 9.81, 4.0, 0.3
pull = g*(math.sin(angle) - friction*math.cos(angle))
history, probe = energy("slides"), History(Path("slides/probe_middle.dat"))
print("   time [s]   speed [m/s]   exact   way [mm]   exact")
for t in (0.1, 0.2, 0.3):
    n = np.argmin(abs(history["time"] - t))
    now = history["time"][n]
    speed, way = history["momentum_x"][n]/mass, probe["x"][n] - probe["x"][0]
    print(f"   {now:8.3f} {speed:12.4f} {pull*now:9.4f} {1e3*way:10.3f} {500*pull*now**2:9.3f}")
    check(f"sliding, {t} s: speed", speed/(pull*now) - 1, 0.015)
    check(f"sliding, {t} s: way", way/(0.5*pull*now**2) - 1, 0.03 if t < 0.15 else 0.015)
check("sliding: energy balance at the end", history["balance_error"][-1], 0.005)
history, probe = energy("stays"), History(Path("stays/probe_middle.dat"))
half = len(probe["x"])//2
creep = (probe["x"][-1] - probe["x"][half])/(probe["time"][-1] - probe["time"][half])
check("sticking: creep over the speed that it would have without friction", creep/(g*math.sin(angle)*probe["time"][-1]), 1e-6)
finish()
END
