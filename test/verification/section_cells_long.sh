#!/bin/sh
#test: long
#test: limit 900
# Cells that a sphere, a cone and a flat punch need for 1 % of the load, with the compliance below a cell and
# without, by sections beside finite elements (doc/user/accuracy.md).
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section_cells.py"
