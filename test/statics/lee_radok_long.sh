#!/bin/sh
#test: long
#test: beside
# A sphere pressed into viscoelastic material and held there, by quasi-static steps, against Lee and Radok.
#test: limit 300
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/lee_radok.py"
