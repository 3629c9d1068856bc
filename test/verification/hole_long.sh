#!/bin/sh
#test: long
#test: limit 600
# A plate with a hole in tension: Kirsch's factor.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/hole.py"
