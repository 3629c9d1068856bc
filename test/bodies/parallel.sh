#!/bin/bash
#test: limit 120
# Contact between bodies on several ranks, after a restart, refused outside the finest level.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/parallel.py" ranks restart refused
