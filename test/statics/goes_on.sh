#!/bin/sh
#test: beside
# &quasi_static: a restart gives the same bits (friction, contact groups, creep, a tool with a load, inertia).
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/goes_on.py"
