#!/bin/bash
#test: long
#test: beside
#test: limit 1800
# The shipped curves of Voce's and Ludwik's laws, of a rounded cone and of a blunted tip, identified by their commands.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/identify_curves.py" "$ROOT" "$GIMP3D"
