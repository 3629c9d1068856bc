#!/bin/sh
# Two hundred valid quasi-static scenes made by chance on 1 and 2 ranks.
#test: long
#test: limit 5400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/random_statics.py" "$WORK/scenes" "$GIMP3D" 200 --ranks 1 1 2 || fail 'see above'
