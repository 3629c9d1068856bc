#!/bin/sh
# A short map of stability: stable wherever a scene may go, unstable somewhere beyond; `make map` has the whole.
#test: long
#test: limit 300
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/stability_map.py" "$WORK" "$BUILD_DIR/test/stability/map" --steps 120 --places 1
