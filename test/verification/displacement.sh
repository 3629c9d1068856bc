#!/bin/bash
#test: long
#test: beside
#test: limit 120
# Displacement, strain and deformation gradient of particles beside exact motions (displacement.py): a body that turns once about, one
# that flies through a level and is split and merged there, one that is pulled to the double; on 1, 2, 4 ranks, and after a restart.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/displacement.py"
