#!/bin/bash
#test: beside
#test: limit 240
# From curves to the material (post/gimp3d/identify.py): readers, the numbers of a curve, materials found again, what is not determined,
# bad input; identify_long.sh has the figures of doc/user/identification.md.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/identify.py" "$ROOT" "$GIMP3D"
