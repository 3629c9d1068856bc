#!/bin/sh
#test: beside
# &quasi_static: uniform stress under a pressure and a plate, a column under its weight, ranks, a tool that leaves, one from afar, one
# that never comes, a step without equilibrium.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/equilibrium.py"
