#!/bin/bash
#test: beside
#test: limit 120
# What a restart refuses, in which words and with which status; damaged checkpoints, where the one before is taken; what may change.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/refused.py"
