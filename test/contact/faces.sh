#!/bin/bash
#test: limit 60
#test: beside
# A block under a plate, its sides on planes of nodes and a quarter of a cell off them: one stress, one load, in explicit and implicit steps; moments of tools in balance.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/faces.py"
