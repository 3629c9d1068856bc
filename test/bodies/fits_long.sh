#!/bin/sh
#test: beside
#test: long
#test: limit 600
# Curved bodies that fit and press fits: all, in quasi-static and in explicit steps.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/fits.py" long
