#!/bin/sh
# Sphere, cone and flat punch beside finite elements on three and four grids each: doc/user/accuracy.md's table. The punch's load
# with one particle a cell swings about the limit (2, 4, 6, 8 cells a radius), so that only its size on the finest grid is bounded.
#test: long
#test: limit 5400
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/indentation.py" "$WORK" "$GIMP3D" 2 sphere=20,30,40 cone=20,40,60 flat8=20,40,60 flat=20,40,60,80 \
   --bound sphere=1.5 cone=3 flat=3 --falling sphere cone flat8
