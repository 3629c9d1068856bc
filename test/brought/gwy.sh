#!/bin/sh
#test: beside
# Gwyddion's own files through `gimp3d-post heights`.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/brought/gwy.py"
