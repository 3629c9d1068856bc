#!/bin/bash
#test: limit 120
#test: beside
# The compliance of the half-space below a cell (doc/developer/theory.md, eq. subcell): loads of a punch, a
# sphere and a cone on about two cells of contact beside finite elements, punches whose rim stands between
# particles, single pressures, energy that comes back. Negative control: the same without the term.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/subcell.py"
