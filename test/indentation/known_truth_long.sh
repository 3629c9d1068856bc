#!/bin/sh
#test: long
#test: limit 2400
# 64 indentations whose truth is known, on coarse cells at several speeds: do the intervals of make hardness hold it?
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/known_truth.py" "$ROOT" "$WORK" "$GIMP3D" --all
