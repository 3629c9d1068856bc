#!/bin/bash
#test: limit 120
#test: beside
# A cylinder on a plate against Hertz. Controls: in one field the stress below is wrong; without the compliance below a cell the width is.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/hertz.py" cylinder one_field without
