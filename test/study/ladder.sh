#!/bin/sh
#test: long
# A short study of input/hertz.nml: its orders, its front, its files; what was run is not run again; what is wrong is refused.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/ladder.py" "$ROOT" "$GIMP3D"
