#!/bin/sh
#test: beside
#test: limit 240
# Two runs do not write to one output directory; the lock of a dead one is taken over; a run that has ended is left alone (lock.py).
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/lock.py"
