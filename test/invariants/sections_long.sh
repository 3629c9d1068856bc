#!/bin/sh
# Three hundred small scenes given by a section, made by chance: laws of mechanics; each is also seen mirrored and turned (plane
# strain), on two ranks, or stopped and gone on.
#test: long
#test: limit 3600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/invariants/random_truth.py" "$WORK/scenes" "$GIMP3D" 300 --sections --jobs 2 || fail 'see above'
