#!/bin/sh
#test: beside
# A block flies and spins through a level: its particles are split and merge again, whatever their domains; the same on 1, 2 and 4 ranks.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/merging.py"
