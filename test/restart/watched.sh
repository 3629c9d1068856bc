#!/bin/sh
#test: long
#test: limit 240
# A run that goes on, or was killed, can be read and drawn (watched.py).
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/watched.py"
