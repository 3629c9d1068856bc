#!/bin/sh
#test: beside
# Bars that hang and double and treble their length, one particle per cell under light tension, a bent beam that comes to rest.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/tension.py"
