#!/bin/sh
#test: long
#test: beside
# The short forms of the hard cases, each figure against its bar; `make hard` runs all of them at length.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/gallery.py" "$WORK/hard" "$GIMP3D" "$BUILD_DIR/test/stability" --short
