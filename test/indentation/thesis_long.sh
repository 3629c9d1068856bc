#!/bin/sh
#test: long
# E2, E3 and E4 of the thesis beside finite elements of their own bodies.
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/thesis.py"
