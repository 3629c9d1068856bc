#!/bin/sh
#test: beside
#test: long
# The sphere on two coarse grids: the load nears the finite elements (the finer grids are in study.sh), and so does the contact area.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/indentation.py" "$WORK" "$GIMP3D" 2 sphere=20,30 --bound sphere=3 --falling sphere --area sphere=15
