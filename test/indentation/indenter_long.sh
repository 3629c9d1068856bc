#!/bin/sh
#test: long
#test: limit 1200
# input/indenter.nml: `make hardness` beside finite elements (doc/user/hardness.md).
. "$(dirname "$0")/../harness/env.sh"
run_scene 2 "$ROOT/input/indenter.nml" || { tail -n 5 run_2.log; fail 'the scene'; }
"$PYTHON" -m gimp3d hardness out/indenter || fail 'make hardness'
"$PYTHON" "$ROOT/test/indentation/indenter.py" out/indenter/hardness.json 3 6 0.025 4
