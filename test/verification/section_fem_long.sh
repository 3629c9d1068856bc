#!/bin/sh
#test: long
#test: limit 600
# Sphere, cone and punch by the section on levels, beside finite elements, down to cells of 0.125 um.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section_fem.py" 1 0.5 0.25 0.125
