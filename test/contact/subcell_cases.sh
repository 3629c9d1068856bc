#!/bin/bash
#test: limit 90
#test: beside
# The compliance below a cell (doc/developer/theory.md, eq. subcell) where two materials meet in a cell, in the
# finest of two levels, at six places of a tool in a cell, and single pressures beside Hertz. Negative control:
# the same without the term.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/subcell_cases.py"
