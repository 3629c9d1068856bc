#!/bin/sh
#test: long
#test: beside
#test: limit 120
# Pressures of particles beside the edge of a level, nearly incompressible.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/edge_pressure.py" "$GIMP3D"
