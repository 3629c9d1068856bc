#!/bin/sh
# Tools that slide and turn, given and loaded, over an elastic block, with friction and a level that follows one: mirrored the
# same, on 1, 2 and 4 ranks the same to the tolerance of the contact solver, after a restart the same to the bit; work and heat
# are where they should be.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/moving_tools.py"
