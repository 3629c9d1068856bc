#!/bin/sh
#test: beside
# Ball and disk between plates with default settings against exact loads; whole particles as the control.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/round_bodies.py"
