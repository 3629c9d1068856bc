#!/bin/bash
#test: long
#test: beside
#test: limit 240
# As same_bits.sh, also plastic flow with pressure and damping, blocks at rest, and levels that follow a tool and the error.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/same_bits.py" long
