#!/bin/sh
#test: beside
# Energies and loads of a dozen shipped scenes against stored ones.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/regression/baselines.py" short
