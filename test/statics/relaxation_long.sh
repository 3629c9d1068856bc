#!/bin/sh
# Relaxation under a sphere over 2000 relaxation times, with shorter and shorter steps.
#test: long
#test: beside
#test: limit 300
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/relaxation.py"
