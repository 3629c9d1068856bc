#!/bin/sh
#test: long
#test: beside
# &quasi_static preconditioner='bpx': products do not grow from 3584 to 229 376 particles.
#test: limit 600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/coarse_grids.py" long
