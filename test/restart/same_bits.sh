#!/bin/bash
#test: beside
#test: limit 240
# A run that is stopped and goes on gives the same bits of all its outputs as one that was never stopped: two levels,
# splitting and a level that moves on 1, 2 and 4 ranks and from 1 to 2 to 4 to 1; contact on the same number of ranks.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/same_bits.py"
