#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# The same at more angles, with all domains, turned to the grid.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/sliding.py" slides_long sticks_long turned_long
