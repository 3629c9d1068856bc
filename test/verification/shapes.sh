#!/bin/sh
#test: beside
#test: long
# Bodies of any shape: volumes of what is cut, pressures on curved surfaces, Lame's tube, stress at the start.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/shapes.py"
