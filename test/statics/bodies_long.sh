#!/bin/sh
#test: long
#test: beside
# &quasi_static with contact groups: on a level, a restart, Hertz's cylinder at several heights of the interface in
# its cell, a change to explicit steps.
#test: limit 1200
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/statics/bodies.py" long
