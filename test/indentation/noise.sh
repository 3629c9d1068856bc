#!/bin/sh
# E2 to 571 nm and E3 to 3.5 um run through; the noise of their loads for three penetration factors (doc/user/accuracy.md).
#test: long
#test: limit 2400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/noise.py" "$WORK" "$GIMP3D" 2
