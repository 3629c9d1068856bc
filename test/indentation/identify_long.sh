#!/bin/bash
#test: long
#test: beside
#test: limit 900
# 40 made-up materials under one cone and under two, found again from curves with 1 % of noise (doc/user/identification.md, How good it is).
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/identify_figures.py" "$ROOT"
