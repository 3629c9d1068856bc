#!/bin/bash
#test: limit 120
#test: beside
# A block slides and sticks on a deformable base as Coulomb says.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/sliding.py" slides sticks turned
