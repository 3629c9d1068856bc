#!/bin/sh
#test: beside
#test: limit 120
# A wheel with sharp teeth, from an STL file, turns beside its middle and tears a block: no centre of a particle comes to lie in it.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/spinning.py"
