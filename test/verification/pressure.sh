#!/bin/sh
#test: beside
# &pressure: total force, uniform stress up to the surface wherever it lies, a patch that turns, work, ranks, refusals.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/pressure.py"
