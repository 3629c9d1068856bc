#!/bin/sh
#test: long
#test: limit 1500
#test: beside
# Ask for an accuracy (make solve), a half-space: beside Hertz.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/solve_half_space.py" "$ROOT" "$GIMP3D"
