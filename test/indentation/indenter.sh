#!/bin/sh
#test: beside
#test: long
#test: limit 600
# A small cone into plastic material, in and out: `make hardness` beside finite elements. The body is eight radii of the contact high, the
# cells a third of it: bounds are wide (indenter_long.sh has the shipped scene).
. "$(dirname "$0")/../harness/env.sh"
run_scene 1 "$ROOT/test/indentation/indenter.nml" || { tail -n 5 run_1.log; fail 'the scene'; }
"$PYTHON" -m gimp3d hardness out/small || fail 'make hardness'
"$PYTHON" "$ROOT/test/indentation/indenter.py" out/small/hardness.json 6 12 0.05 15
