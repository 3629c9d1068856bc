#!/bin/bash
#test: long
#test: limit 120
#test: beside
# contact/edge with a rounded cone. Negative control: without the compliance below a cell.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/edge.py" long
