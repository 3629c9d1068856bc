#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# Spheres in a deformable box for 20 000 steps.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/box.py" box_long
