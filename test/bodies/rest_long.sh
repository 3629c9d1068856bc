#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# The same at all offsets, with all domains, 1, 8 and 27 particles a cell, on half the cells, on levels.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/rest.py" at_rest_long stiff_long levels_long
