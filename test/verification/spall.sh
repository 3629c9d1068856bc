#!/bin/sh
#test: beside
# Shocks in copper: Hugoniot pressure and shock speed at 500 and 1000 m/s, release, spall at the largest tension, what has failed.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/spall.py"
