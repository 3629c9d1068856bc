#!/bin/bash
#test: long
#test: limit 900
# A sphere on atoms against the anisotropic half-space: input/atoms_sphere.nml; or a run of it that is there:   sphere.sh DIRECTORY
[ $# = 0 ] || set -- "$(realpath "$1")"
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/atoms/sphere.py" "$@"
