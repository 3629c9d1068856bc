#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# A sphere that is drawn off a block, beside Maugis; a bonded double cantilever beam, beside beam theory.
# Press fits of tubes with more cells and in all domains.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/adhesion.py" pull_off cantilever tubes_long
