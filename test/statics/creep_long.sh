#!/bin/sh
#test: beside long
# input/hold.nml on 2 ranks: the load of a sphere that is held falls, the exponent of creep comes back; a run that stops in the middle of
# the hold and goes on.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/creep.py" sphere
