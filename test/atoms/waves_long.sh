#!/bin/bash
#test: long
#test: limit 900
# What a box of atoms throws back of pulses of 20, 10 and 5 cells; of some:   waves_long.sh 10 5
. "$(dirname "$0")/../harness/env.sh"
mkdir -p "$WORK/waves" 2>/dev/null
exec "$PYTHON" "$ROOT/test/atoms/waves.py" "$@"
