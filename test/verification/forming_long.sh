#!/bin/bash
#test: limit 900
#test: long
#test: beside
# The same with what a scene may say instead; stress in a disk that spins for ten turns.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/verification/forming.py" billet choices disk
