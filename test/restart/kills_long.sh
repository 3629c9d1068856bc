#!/bin/bash
#test: limit 1200
#test: long
# 100 times kill -9 at random moments, on 1 and 2 ranks in turn.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/kills.py" 100 2
