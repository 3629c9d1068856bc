#!/bin/bash
#test: beside
#test: limit 240
# Noise of load and depth in curves of a known truth: intervals hold it at their rates, with what is free; identify_noise_long.sh has more.
. "$(dirname "$0")/../harness/env.sh"
export OPENBLAS_NUM_THREADS=1
"$PYTHON" "$ROOT/test/indentation/identify_noise.py" 1
