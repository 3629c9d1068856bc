#!/bin/sh
#test: long
#test: beside
# A cone held in metal that has flowed: the linear problems of the hold, where conjugate gradients stall (doc/developer/theory.md).
#test: limit 600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/held.py"
