#!/bin/sh
# A thousand scenes changed at random.
#test: long
#test: limit 3600
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/hostile/scenes.py" 1000
