#!/bin/bash
#test: limit 120
#test: beside
# Bodies at rest on each other: load, layers beside the interface, a stiff body on a soft one. Control: in one field a sixth too stiff.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/rest.py" at_rest stiff one_field levels
