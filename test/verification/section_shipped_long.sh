#!/bin/sh
#test: long
#test: beside
#test: limit 120
# gimp3d --section of all shipped scenes: what it writes runs, and is the same body.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section_shipped.py"
