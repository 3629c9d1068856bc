#!/bin/sh
# Locking on all grids and for all Poisson's ratios: doc/user/accuracy.md's tables.
#test: long
#test: limit 1800
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/locking.py" "$WORK" "$GIMP3D" --long
