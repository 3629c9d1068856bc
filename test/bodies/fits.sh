#!/bin/sh
#test: beside
# Curved bodies of two groups that fit: nothing where nothing acts, Lame's pressure of a press fit.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/fits.py"
