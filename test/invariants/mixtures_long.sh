#!/bin/sh
# Five hundred small scenes made by chance of all parts together: groups with holes, implicit steps, levels by the error, crystals in
# grains, files. Each is also seen mirrored, turned, on two ranks, or stopped and gone on.
#test: long
#test: limit 7200
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/invariants/random_truth.py" "$WORK/scenes" "$GIMP3D" 500 --mixtures --jobs 2 || fail 'see above'
