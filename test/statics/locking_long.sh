#!/bin/sh
#test: long
#test: beside
# E5 (input/bilinear_patch.nml) by quasi-static steps with &anti_locking: against explicit steps, and on cells of 0.25 mm finite elements.
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/locking.py" long
