#!/bin/sh
#test: long
#test: beside
# &anti_locking in quasi-static steps, and metal that flows: against explicit steps, other steps, other numbers of ranks; back to explicit steps.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/locking.py"
