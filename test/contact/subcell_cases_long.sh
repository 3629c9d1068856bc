#!/bin/bash
#test: long
#test: limit 180
#test: beside
# contact/subcell_cases at six places of a tool in a cell. Negative controls: all of it without the term.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/subcell_cases.py" long
