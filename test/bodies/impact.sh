#!/bin/bash
#test: limit 120
#test: beside
# Two spheres against finite elements; momentum, energy in an oblique impact. Control: in one field they stick.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/impact.py" head_on flight one_field
