#!/bin/sh
#test: limit 60
#test: beside
# One particle per cell and domains that deform, in quasi-static steps: what the ghost penalty dissipates.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/one_a_cell.py"
