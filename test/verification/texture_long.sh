#!/bin/sh
#test: long
#test: limit 600
# The texture of copper after plane-strain compression (input/texture.nml).
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/texture.py"
