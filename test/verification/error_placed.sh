#!/bin/sh
#test: beside
#test: limit 120
# Levels that the error places hold what tools and other bodies touch, from the first step on, within their budget.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/error_placed.py" "$GIMP3D" "$ROOT"
