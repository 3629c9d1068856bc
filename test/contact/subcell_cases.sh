#!/bin/bash
#test: limit 90
#test: beside
# The compliance below a cell (doc/developer/theory.md, eq. subcell) where two materials meet in a cell, in the
# finest of two levels, at three places of a tool in a cell, and single pressures beside Hertz.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/subcell_cases.py"
