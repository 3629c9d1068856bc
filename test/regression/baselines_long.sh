#!/bin/sh
#test: long
# Energies and loads of nineteen shipped scenes against stored ones, and a planted drift in each.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/regression/baselines.py" whole
