#!/bin/sh
#test: beside
#test: long
#test: limit 1800
# Ball and disk between plates at three places in their cells, a sphere deep in a block, spheres on a ball, a ball of
# metal that is flattened: default settings.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/round_bodies.py" long
