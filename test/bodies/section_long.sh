#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# The same finer, in all domains, at several speeds, static and explicit.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/section.py" two_balls_long press_fits_long
