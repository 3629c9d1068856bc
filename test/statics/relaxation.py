"""The load of a sphere that is held in creeping material for 2000 relaxation times (input/hold.nml) hardly
hangs on the lengths of the steps: with half and a quarter of the limit of creep it is the same within 2 % all
the way. usage: relaxation.py (in an empty directory; GIMP3D is the program)"""

import numpy as np
from static_scenes import ROOT, check, counts, finish, run, tool

scene = (ROOT / "input/hold.nml").read_text()
loads, times = [], np.geomspace(1.1, 1e6, 50)
for limit in (0.1, 0.05, 0.025):
    name = f"limit_{limit}"
    text = scene.replace("step=0.1 /", f"step=0.1, creep_limit={limit} /").replace("out/hold", name)
    log = run(text, 1)
    history = tool(name, "sphere")
    going = history["time"] > 0
    loads.append(np.interp(np.log(times), np.log(history["time"][going]), history["load_z"][going]))
    print(f"   limit {limit}: {counts(log)[0]:.0f} steps, load {1e6 * loads[-1][-1]:.1f} uN after 1e6 s")
for one, other in zip(loads, loads[1:]):
    check("load with half the limit of creep, over that with the whole", other / one - 1, 0.02)
check("load that is left after 1e6 s, over that at the start", loads[-1][-1] / loads[-1][0], 0.12)
finish()
