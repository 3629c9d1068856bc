#!/bin/sh
#test: beside
# &quasi_static preconditioner='bpx': the loads of the diagonal with fewer products, on levels, on 2 ranks.
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/coarse_grids.py" short
