#!/bin/sh
#test: long
# Ask for an accuracy (make solve): the model of errors and prices, and the command with a stand-in for the program whose errors are known.
#test: limit 240
#test: beside
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/study/solve.py" "$ROOT"
