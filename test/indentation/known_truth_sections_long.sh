#!/bin/sh
#test: long
#test: limit 1200
# The 64 indentations of known_truth_long as axisymmetric sections of the same cells.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/known_truth.py" "$ROOT" "$WORK" "$GIMP3D" --section --all
