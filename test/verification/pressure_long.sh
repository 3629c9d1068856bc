#!/bin/sh
#test: long
#test: beside
# As pressure.sh, with all its rods.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/pressure.py" long
