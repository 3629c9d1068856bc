#!/bin/sh
# Two hundred valid quasi-static scenes made by chance on 1 and 2 ranks, and 24 with two bodies.
#test: long
#test: limit 5400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/random_statics.py" "$WORK/scenes" "$GIMP3D" 200 --ranks 1 1 2 || fail 'see above'
"$PYTHON" "$ROOT/test/stability/random_statics.py" "$WORK/two" "$GIMP3D" 24 --first 1000 --ranks 1 1 2 || fail 'see above'
