#!/bin/sh
#test: beside
# Quasi-static steps of creep, metal and a viscoelastic block are the same along other axes of the grid.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/turned.py"
