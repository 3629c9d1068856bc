#!/bin/sh
#test: beside
# Metal in dies from files whose faces meet at sharp concave edges, against one file a face and the law.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/concave.py"
