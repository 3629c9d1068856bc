#!/bin/bash
#test: beside
#test: limit 120
# One particle per cell between a floor and a wall that both have friction: forces on one point of each face left the rims without their share,
# and strain energy climbed (theory.md, eq. face-mean). Now 'corners' comes to rest, and 'fixed' keeps near it.
. "$(dirname "$0")/../harness/env.sh"
for domain in fixed corners; do
   sed "s/'fixed'/'$domain'/; s:out/in_a_corner:$domain:" "$ROOT/test/contact/in_a_corner.nml" >$domain.nml
   run_scene 1 $domain.nml $domain.log || { cat $domain.log; fail "$domain"; }
   grep -q '^guard: no retries' $domain.log || fail "$domain: $(grep '^retry' $domain.log)"
done
"$PYTHON" - <<'END'
from runs import *
fixed, corners = (energy(name).columns for name in ("fixed", "corners"))
half = len(corners["strain"]) // 2
at_rest = corners["strain"][-1]
check("corners: kinetic energy over strain energy", corners["kinetic"][-1] / at_rest, 1e-4)
check("corners: strain energy over that halfway, less 1", at_rest / corners["strain"][half] - 1, 0.1)
check("fixed: strain energy over that of corners", fixed["strain"][-1] / at_rest, 1.6)
finish()
END
