#!/bin/sh
# E3 and E4 beside uniform fine grids: doc/user/accuracy.md's table.
#test: long
#test: limit 5400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/nested_scenes.py" sphere cone
