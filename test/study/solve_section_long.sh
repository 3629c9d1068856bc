#!/bin/sh
#test: long
#test: limit 600
# make solve with pilots by the section, beside finite elements: the error that was said holds for the quarter model.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/solve_section.py" "$ROOT" "$GIMP3D"
