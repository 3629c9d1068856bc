#!/bin/sh
#test: long
# A measured tip: the imprint of a bump on its face lies at the right corner.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/brought/tip.py"
