#!/bin/sh
# Products where a body's surface has risen by round-off above a plane of nodes (doc/developer/theory.md, Ghost penalty).
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/hair.py"
