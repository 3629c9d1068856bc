#!/bin/bash
#test: limit 120
# Contact groups in scenes given by a section: plane strain beside a slice of 3D with friction, two balls beside finite elements,
# press fits beside Lame; a surface across the edge of a level; two ranks and a restart. Controls: one field, rings that are apart.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/section.py" plane two_balls goes_on press_fits socket level_edge
