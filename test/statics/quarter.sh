#!/bin/sh
#test: limit 60
#test: beside
# A quarter and the whole of a block under a sphere, in quasi-static steps: the same load.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/quarter.py"
