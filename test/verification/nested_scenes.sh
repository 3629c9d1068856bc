#!/bin/sh
#test: beside
# Scenes on nested levels beside one level: a sphere on levels that stay and move, E5.
#test: limit 150
#test: long
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/nested_scenes.py" moving patch
