#!/bin/sh
#test: long
#test: limit 240
#test: beside
# Ask for an accuracy (make solve): the program itself on a bar with an exact answer.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/solve_bar.py" "$ROOT" "$GIMP3D"
