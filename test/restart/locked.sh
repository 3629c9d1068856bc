#!/bin/sh
#test: long
#test: limit 240
# Whoever is killed while it opens a file leaves a lock of that name on the machine: later runs do not wait for it.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/locked.py"
