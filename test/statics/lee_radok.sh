#!/bin/sh
#test: long
# A sphere pressed into viscoelastic material and held there, by quasi-static steps, and a ball on a block, against Lee and Radok.
#test: limit 100
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/lee_radok.py"
