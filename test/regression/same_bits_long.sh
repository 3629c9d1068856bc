#!/bin/bash
#test: long
#test: limit 240
# As same_bits.sh, on 1, 2, 3 and 4 ranks.
. "$(dirname "$0")/../harness/env.sh"
export WORK
exec bash "$ROOT/test/regression/same_bits.sh" 2 3 4
