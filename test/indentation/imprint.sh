#!/bin/sh
# The area within which a pyramid touches, from the profile: made-up surfaces whose area is known.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/imprint.py" "$ROOT"
