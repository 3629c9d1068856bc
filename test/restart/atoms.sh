#!/bin/bash
#test: beside
#test: limit 120
# A tool presses a box of atoms; the run is stopped by a signal and taken up again: the same bits. What snapshots hold of atoms.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/atoms.py"
