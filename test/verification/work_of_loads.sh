#!/bin/sh
#test: beside
# Work of loads by the motion of the particles they act on: rods that are pushed and pulled, gravity, tools; the guard's limit.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/work_of_loads.py"
