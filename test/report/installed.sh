#!/bin/bash
#test: long
#test: beside
#test: limit 600
# The Python package as `pip install ./post` makes it in a fresh environment: a run, its hardness, its report with its charts, and
# the command. Without a package index it is left out.
. "$(dirname "$0")/../harness/env.sh"
unset PYTHONPATH
cp -r "$ROOT/post" post
"$PYTHON" -m venv fresh
if ! fresh/bin/pip install --quiet --disable-pip-version-check ./post >pip.log 2>&1; then
   grep -qi 'connection\|could not find a version\|network' pip.log || { cat pip.log; fail 'pip install ./post'; }
   echo 'left out: no package index can be reached'
   exit 0
fi
GIMP3D=$GIMP3D fresh/bin/python - "$ROOT" <<'END' || fail 'the installed package'
import sys
from pathlib import Path
import gimp3d
from gimp3d import Scene, run
assert not Path(gimp3d.__file__).is_relative_to(sys.argv[1]) or "fresh" in gimp3d.__file__, gimp3d.__file__
scene = Scene(Path(sys.argv[1]) / "input/axisymmetric_indenter.nml")
scene.set("output", "directory", "pressed")
result = run(scene, progress=False)
found = result.hardness()
assert 1e8 < found["hardness_true"] < 1e11, found
assert "Plotly" in result.report().read_text()
END
fresh/bin/gimp3d-post plots pressed || fail 'gimp3d-post plots'
[ -s pressed/load_depth.png ] || fail 'no picture'
