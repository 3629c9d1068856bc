#!/bin/sh
#test: beside
# Scenes given by a section: a ring that breathes, rings that fly through a level, a sphere beside finite elements, plane strain beside
# a slice of 3D; the same on 1, 2 and 4 ranks and after a restart; and what such a scene may not have.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section.py"
