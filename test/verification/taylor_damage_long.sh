#!/bin/sh
#test: long
#test: limit 600
# Where a Taylor bar with damage fails (input/taylor_damage.nml), on two grids.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/taylor_damage.py"
