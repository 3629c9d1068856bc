#!/bin/sh
#test: beside
# E5 on its own grid: it runs, nearly at rest, and its energy balances.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/bilinear_patch.py" 0.5
