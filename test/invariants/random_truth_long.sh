#!/bin/sh
# Five hundred small scenes made by chance: laws of mechanics, and the same seen otherwise.
#test: long
#test: limit 3600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/invariants/random_truth.py" "$WORK/scenes" "$GIMP3D" 500 --jobs 2 || fail 'see above'
