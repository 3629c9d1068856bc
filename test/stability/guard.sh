#!/bin/bash
#test: beside
#test: limit 480
# The guard: faults that are planted end the run with status 3, one sentence and a whole last good state, on 1 and 2 ranks; or, planted
# once, are got over by a retry. What is unstable at the given time step finishes with retries, without energy from nowhere.
. "$(dirname "$0")/../harness/env.sh"
PLANTED=$BUILD_DIR/test/stability/guard_planted
[ -x "$PLANTED" ] || fail "$PLANTED is not there: make tests"
[ "$BUILD" != debug ] || { echo 'the debug build stops at the first NaN by itself'; exit 0; }
export PLANTED
exec "$PYTHON" "$ROOT/test/stability/guard.py"
