#!/bin/sh
#test: beside
# The load of a quarter model beside that of the section that gimp3d --section writes of it.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section_quarter.py" hertz
