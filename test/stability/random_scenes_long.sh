#!/bin/sh
# Two hundred valid scenes made by chance on 1 to 4 ranks.
#test: long
#test: limit 3600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/random_scenes.py" "$WORK/scenes" "$GIMP3D" 200 || fail 'see above'
