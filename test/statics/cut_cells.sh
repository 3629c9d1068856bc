#!/bin/sh
# Products where cells are cut by round-off alone (doc/developer/theory.md, Ghost penalty), and of metal with inertia.
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/cut_cells.py"
