#!/bin/sh
#test: long
#test: beside
# &quasi_static: tools that loads push (a ball, a plate on a block that creeps), friction (a block that stays on an incline, one that
# is pushed over a floor), against exact answers and on several ranks.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/pushed.py"
