#!/bin/sh
#test: limit 120
#test: beside
# A rod goes through a plate of another contact group, whose material erodes: contact goes on at the faces that erosion uncovers.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/erosion.py"
