#!/bin/sh
#test: limit 60
#test: beside
# A shock in a column one cell wide between planes of symmetry: the pressure of a water hammer, no motion sideways.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/water_hammer.py"
