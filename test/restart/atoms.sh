#!/bin/bash
#test: beside
#test: limit 120
# A tool presses a box of atoms; the run is stopped by a signal and taken up again: the same bits. What snapshots hold of atoms.
. "$(dirname "$0")/../harness/env.sh"
[ -d /usr/share/lammps/potentials ] || { echo '  left out, LAMMPS and its potentials are not there: a run with atoms taken up again'; exit 0; }
exec "$PYTHON" "$ROOT/test/restart/atoms.py"
