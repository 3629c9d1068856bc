#!/bin/sh
# A pressure patch beside Love's half-space, on a coarse grid.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/love.py" 0.03 0.5
