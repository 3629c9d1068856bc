#!/bin/bash
#test: limit 90
#test: beside
# The compliance below a cell in quasi-static steps: loads beside finite elements, with the run without it as control; restart to the bit; explicit steps that follow.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/subcell.py"
