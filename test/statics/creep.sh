#!/bin/sh
#test: beside check
# &quasi_static: blocks of maxwell and norton held, and one that is squeezed as it creeps, against the exact answers.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/creep.py"
