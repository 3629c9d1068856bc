#!/bin/bash
#test: beside
#test: limit 240
# 20 times kill -9 at random moments, each time the run is taken up again: the same bits in the end.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/kills.py" 20
