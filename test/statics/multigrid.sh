#!/bin/sh
#test: long
#test: beside
# &quasi_static preconditioner='gamg': the same loads with fewer products, on 1 and 2 ranks, with friction, loads, inertia.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/multigrid.py" short
