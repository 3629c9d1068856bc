#!/bin/sh
#test: long
#test: beside
# &quasi_static: 500 steps of j2 with loading and unloading, at most 6 Newton iterations each, none halved.
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/cycles.py"
