#!/bin/sh
#test: beside
# Blocks that creep under a pressure and relax under a plate, against exact curves.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/relaxing.py"
