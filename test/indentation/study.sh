#!/bin/sh
# Sphere, cone and flat punch beside finite elements on two or three grids each: doc/accuracy.md's table. The edge of the flat punch is
# singular: its error is of first order in the cell, 6 % on the finest grid here, so that its bound is on the extrapolated load.
#test: long
#test: limit 5400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/indentation.py" "$WORK" "$GIMP3D" 2 sphere=20,30,40 cone=20,40 flat=20,40,60 \
   --bound sphere=1.5 cone=3 --limit flat=3 --falling
