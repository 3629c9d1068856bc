#!/bin/bash
#test: limit 120
#test: beside
# Two sheets that are bent together slide on each other by thickness times angle. Control: one sheet, four times as stiff.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/sheets.py" bent
