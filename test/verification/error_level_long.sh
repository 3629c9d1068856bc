#!/bin/sh
#test: long
#test: limit 300
# Levels that the estimated error places follow a ball that slides and a cylinder that rolls.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/error_level.py" "$GIMP3D"
