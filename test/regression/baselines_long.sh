#!/bin/sh
#test: long
# Energies of fifteen shipped scenes against stored ones.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/regression/baselines.py"
