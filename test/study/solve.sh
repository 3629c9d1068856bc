#!/bin/sh
# make solve: an accuracy is asked for and got, its price first; what is out of reach is told.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/solve.py" "$ROOT" "$GIMP3D"
