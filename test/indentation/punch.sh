#!/bin/sh
# Load and contact area of a flat punch, whose edge is where the tool ends, beside finite elements on a coarse grid.
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/indentation.py" "$WORK" "$GIMP3D" 1 flat=20 --bound flat=7 --area flat=6
