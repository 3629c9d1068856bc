#!/bin/sh
#test: beside
#test: long
#test: limit 600
# Ball and disk between plates at three places in their cells, and a sphere deep in a block: default settings.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/round_bodies.py" long
