#!/bin/sh
#test: long
#test: beside
# &quasi_static mode='newmark': a bar's period, decay and energy against the rule's, ranks, restart, free fall, a bounce, what is refused.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/newmark.py"
