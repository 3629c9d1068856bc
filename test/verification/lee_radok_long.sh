#!/bin/sh
#test: long
#test: limit 300
# A sphere pressed into viscoelastic material and held there, against Lee and Radok.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/lee_radok_long.py"
