#!/bin/bash
#test: limit 120
#test: beside
# More than two bodies at a place: a stack, a tool on two bodies, a body over the joint of two.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/several.py" stack tool_on_two
