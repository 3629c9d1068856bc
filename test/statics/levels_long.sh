#!/bin/sh
#test: long
#test: beside
# &quasi_static on nested levels: a ball's load against that on a grid as fine everywhere; a ball that ploughs, with its level.
#test: limit 900
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/levels.py" long
