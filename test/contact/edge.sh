#!/bin/bash
#test: limit 60
#test: beside
# Radius of elastic contacts on three and five cells (doc/developer/theory.md, eq. edge-field): sphere and cone
# beside exact ones at the same load.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/edge.py"
