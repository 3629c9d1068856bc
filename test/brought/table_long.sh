#!/bin/sh
#test: long
# Files of grains, heights and surfaces as other programs write them: a value or a sentence each, in a table; changed files.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/brought/table.py" "$BUILD_DIR/test/input/read_scene"
