#!/bin/sh
# Where steps end that have no equilibrium, and times that they must meet.
#test: beside
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/faults.py"
