#!/bin/sh
# A pressure patch beside Love's half-space: doc/user/accuracy.md's table.
#test: long
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/love.py" 0.02 0.5 0.25
