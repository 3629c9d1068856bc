#!/bin/sh
#test: beside
# Tools from files: their load against formulas, turned, on two ranks, hollow; what is drawn of them.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/surfaces.py"
