#!/bin/sh
#test: long
#test: beside
# &quasi_static with contact groups: Hertz's cylinder finer, at several heights of the interface in its cell.
#test: limit 1200
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/bodies.py" long
