#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# The same at all heights of the interface in its cell, finer.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/hertz.py" cylinder_long
