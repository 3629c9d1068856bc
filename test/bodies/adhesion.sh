#!/bin/bash
#test: beside
# Adhesion and bonds between blocks: force, work and speed are exact; overlaps that are pressed out, or kept; tubes beside Lame.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/adhesion.py" blocks press_fit tubes
