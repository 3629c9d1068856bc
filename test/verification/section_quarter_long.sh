#!/bin/sh
#test: long
#test: limit 900
# The same of the demonstration, and of a cone in metal on five levels.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section_quarter.py" demo indenter
