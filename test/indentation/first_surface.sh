#!/bin/sh
#test: beside
#test: limit 120
# The surface below a tool at the start, as the head of its history says, on bodies of all shapes with and without cuts.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/first_surface.py"
