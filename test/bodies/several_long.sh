#!/bin/bash
#test: long
#test: limit 1200
#test: beside
# The same with thin plates, offsets, domains that follow the material.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/several.py" stack_long tool_on_two_corners over_a_joint_long
