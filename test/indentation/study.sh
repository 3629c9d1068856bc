#!/bin/sh
# Sphere, cone and flat punch beside finite elements on three grids each: doc/accuracy.md's table.
#test: long
#test: limit 3600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/indentation.py" "$WORK" "$GIMP3D" 2 sphere=20,40,60 cone=20,40,60 flat=20,40,60 \
   --bound sphere=3 cone=3 flat=3 --falling
