#!/bin/sh
#test: limit 120
# Loads with levels of several parts, balls and shells against those with the box around them.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/level_parts.py" "$GIMP3D" mpirun
