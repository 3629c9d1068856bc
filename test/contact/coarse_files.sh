#!/bin/sh
#test: beside
# Areas of contact and shares of tools from files of few triangles, against those by formulas.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/coarse_files.py"
