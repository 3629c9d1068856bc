#!/bin/sh
# 100 000 steps with contact, two levels and checkpoints on 2 ranks: memory flat, no file left open.
#test: limit 900
#test: long
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/restart/soak.py" 100000 2
