#!/bin/sh
#test: beside
# Files of surfaces: thirty that are refused, some that are not, and a run that does not go on with another file.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/hostile/surfaces.py" "$BUILD_DIR/test/input/read_scene"
