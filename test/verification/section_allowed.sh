#!/bin/sh
#test: beside
# What scenes given by a section allow: effects as in a slice of 3D, a user's law, restart to the bit, --section, two and four values.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/section_allowed.py"
