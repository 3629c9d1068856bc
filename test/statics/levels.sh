#!/bin/sh
#test: long
#test: beside
# &quasi_static on nested levels: one stress under a pressure, weight, a ball on 1, 2 and 4 ranks.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/levels.py" short
