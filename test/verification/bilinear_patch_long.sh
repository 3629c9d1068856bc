#!/bin/sh
# E5 on three grids, with and without anti-locking: doc/user/accuracy.md's table.
#test: long
#test: limit 5400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/bilinear_patch.py" 0.5 0.25 0.125 --falling
"$PYTHON" "$ROOT/test/verification/bilinear_patch.py" 0.5 0.25 --locking
