#!/bin/sh
#test: beside
# &quasi_static with contact groups: blocks pressed together, pushed over each other, held by friction, a load that
# begins small; on several ranks.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/bodies.py"
