#!/bin/sh
#test: beside
#test: limit 120
# The analysis of load-depth curves (post/gimp3d/oliver_pharr.py): an instrument's numbers to the digits, formulas, 200 curves with noise.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/oliver_pharr.py" "$ROOT"
