#!/bin/sh
# A Vickers pyramid (input/vickers.nml) beside the cone of equal area in the same block.
#test: long
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/vickers.py"
