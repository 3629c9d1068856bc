#!/bin/bash
#test: beside
#test: limit 120
# Every file of a run opens by its own name in the programs of others that are installed (readers.py), and the table of them in
# doc/user/output.md says what each shows. `readers.py --table` writes its rows.
. "$(dirname "$0")/../harness/env.sh"

run_scene 1 "$ROOT/test/report/readers.nml" || { cat run_1.log; fail 'the run'; }
"$PYTHON" -m gimp3d tool_surface read >tools.log || { cat tools.log; fail 'tools.xdmf'; }
"$PYTHON" "$ROOT/test/report/readers.py" read "$ROOT/doc/user/output.md"
