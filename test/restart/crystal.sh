#!/bin/bash
#test: long
#test: beside
#test: limit 120
# A polycrystal that spins and flows, on two levels, is split and changes blocks and levels: the same bits on 1, 2 and 4 ranks and after
# a restart; its energy is kept; grains of one orientation are one crystal, to the bit.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/crystal.py"
