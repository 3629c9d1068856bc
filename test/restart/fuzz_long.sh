#!/bin/bash
#test: limit 1200
#test: long
# 200 mutated checkpoints, with the old seal and with a good one: the program ends with status 0, 2, 4 (or 3 where the numbers of a
# particle were changed under a good seal), in one sentence, never by a signal.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/fuzz.py" 200
