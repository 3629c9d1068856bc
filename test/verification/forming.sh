#!/bin/bash
#test: limit 200
#test: beside
# A billet upset by 60 % between smooth dies, with nothing said of domains and effects: the exact load within 1 %; and what a run with
# cubes says of its range.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/forming.py" billet
