#!/bin/bash
#test: limit 1200
#test: long
#test: beside
# The same for other domains, numbers of particles, cells and speeds; extrusion through a round die, and drawing through it.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/energy.py" cylinder slope quarter_speed elastic viscoelastic plain boxes corners one_per_cell many inner half_cell \
   fast extrusion drawing rattling squeezed
