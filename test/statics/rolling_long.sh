#!/bin/sh
#test: long
#test: beside
# input/slow_rolling.nml against the explicit scheme.
#test: limit 600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/rolling.py"
