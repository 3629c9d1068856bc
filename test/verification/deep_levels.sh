#!/bin/sh
#test: limit 120
# Particles that are split on the finest of five levels because they become too long.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/verification/deep_levels.py"
