#!/bin/bash
#test: limit 120
# A sphere pressed into a block whose particles' domains stay, stretch or follow the material: nearly the same load, which must differ a
# little (the domains do act), and no overlap.
. "$(dirname "$0")/../harness/env.sh"
for domain in fixed stretch corners; do
   sed "s:DIRECTORY:$domain:; s/end_time=2.4e-8/end_time=1e-8/" "$ROOT/test/contact/in_and_out.nml" >$domain.nml
   echo "&time domain='$domain' /" >>$domain.nml
   run_scene 2 $domain.nml || { cat run_2.log; fail "$domain"; }
done
"$PYTHON" - <<'END'
from runs import *

loads = {}
for domain in ("fixed", "stretch", "corners"):
    history = History(Path(domain) / "tool_ball.dat")
    late = history["time"] > 8e-9
    loads[domain] = np.mean(history["load_z"][late])
    check(f"{domain}: largest overlap, cells", history["max_gap_violation"]/1e-6, 0.01)
print(f"   load over the last fifth, fixed: {loads['fixed']:.5f} N")
for domain in ("stretch", "corners"):
    check(f"{domain}: load against that of fixed domains", loads[domain]/loads["fixed"] - 1, 0.02)
    require(f"{domain}: another load than that of fixed domains", abs(loads[domain]/loads["fixed"] - 1) > 1e-6)
finish()
END
