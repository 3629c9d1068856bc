#!/bin/bash
#test: long
#test: beside
#test: limit 1200
# The same as identify_noise.sh with seven curves for each noise and each FREE; none of them is off by far.
. "$(dirname "$0")/../harness/env.sh"
export OPENBLAS_NUM_THREADS=1
"$PYTHON" "$ROOT/test/indentation/identify_noise.py" 7 long
