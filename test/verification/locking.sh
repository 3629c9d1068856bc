#!/bin/sh
#test: long
# Nearly incompressible bending and pressure, plastic flow under a punch, energy: with and without anti-locking. The finer grids
# are in locking_long.sh.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/locking.py" "$WORK" "$GIMP3D"
