#!/bin/bash
#test: limit 120
#test: beside
# Spheres in a deformable box: energy never above the start.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/box.py" box
