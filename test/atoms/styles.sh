#!/bin/bash
#test: long
#test: limit 300
# The patch of test/atoms/patch.f90 with potentials of LAMMPS of each style.
. "$(dirname "$0")/../harness/env.sh"
[ -d /usr/share/lammps/potentials ] || { echo '  left out, the potentials of LAMMPS are not there: styles of potentials'; exit 0; }
cd "$ROOT" && exec "$BUILD_DIR/test/atoms/patch" styles
