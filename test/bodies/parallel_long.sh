#!/bin/bash
#test: long
#test: limit 1200
# The same on 1, 2 and 4 ranks for longer, with and without friction.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/parallel.py" ranks_long levels_long
