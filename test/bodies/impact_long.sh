#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# The same at 10 cells a radius, several speeds, domains and places on the grid.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/impact.py" head_on_long flight_long
