#!/bin/sh
#test: beside check
# &quasi_static: blocks of maxwell and norton held, against the exact answers; a sphere held: the load falls, the exponent of creep comes
# back; a run that stops in the middle of the hold and goes on.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/creep.py"
