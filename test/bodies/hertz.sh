#!/bin/bash
#test: limit 120
#test: beside
# A cylinder on a plate against Hertz. Control: in one field the stress below is wrong.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/hertz.py" cylinder one_field
