#!/bin/sh
#test: long
#test: limit 1800
# Pressures beside the edge of the finest level under a cone in metal.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/edge_cone.py" "$GIMP3D"
