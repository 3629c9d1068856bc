#!/bin/sh
# Bars that hang, to four times their length with 1, 8 and 27 particles per cell; bent beams of all domains that come to rest.
#test: long
#test: limit 600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/tension.py" long
