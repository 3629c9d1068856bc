#!/bin/bash
#test: long
#test: limit 1800
# Coupled models against LAMMPS alone; one of them:   all_atoms_long.sh void
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/atoms/all_atoms.py" "$@"
