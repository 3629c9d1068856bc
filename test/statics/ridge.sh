#!/bin/sh
#test: beside
# &quasi_static: a wedge and a pyramid over a column of particle centres: no load sideways, work is energy.
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/ridge.py"
