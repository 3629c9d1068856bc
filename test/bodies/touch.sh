#!/bin/bash
#test: check
#test: limit 120
#test: beside
# Bodies of two contact groups feel each other where they touch. Control: in one velocity field more than a cell before.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/touch.py" spheres on_block blocks one_field
