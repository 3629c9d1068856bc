#!/bin/sh
# Taylor bar of copper on two grids, with and without affine transfer and anti-locking, beside the experiment.
#test: long
#test: limit 3600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/taylor.py" 5 8
