#!/bin/sh
#test: long
#test: limit 600
# The same of spinning.sh, also with cubes, and in rubber.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/spinning.py" all
