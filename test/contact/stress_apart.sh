#!/bin/sh
# Tools and a stress that has a solve of its own ('usf', 'musl'): pressed points go with the tool there too (theory.md, eq. pressed-speeds).
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/stress_apart.py"
