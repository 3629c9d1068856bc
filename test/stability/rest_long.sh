#!/bin/bash
#test: limit 900
#test: long
#test: beside
# A column that is pressed, by &pressure and by a tool, and damped: it comes to rest and bears the exact stress in every particle, though its
# free sides bulge by a hair into empty cells.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/rest.py" 1 27
