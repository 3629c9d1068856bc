#!/bin/sh
#test: long
#test: limit 300
# A level that the estimated error places follows a ball that slides.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/error_level.py" "$GIMP3D"
