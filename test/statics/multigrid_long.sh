#!/bin/sh
#test: long
#test: beside
# &quasi_static preconditioner='gamg': products do not grow from 3584 to 229 376 particles.
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/multigrid.py" long
