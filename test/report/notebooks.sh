#!/bin/bash
#test: long
#test: beside
#test: limit 600
# The notebooks of doc/user/notebooks: all their cells in order, what they assert included; a close-up and a movie of their runs.
. "$(dirname "$0")/../harness/env.sh"
for notebook in "$ROOT"/doc/user/notebooks/*.ipynb; do
   echo "$(basename "$notebook")"
   MPLBACKEND=agg "$PYTHON" - "$notebook" <<'END' || fail "$(basename "$notebook")"
import json, sys
names = {"__name__": "__main__"}
for cell in json.load(open(sys.argv[1]))["cells"]:
    if cell["cell_type"] == "code":
        exec(compile("".join(cell["source"]), sys.argv[1], "exec"), names)
END
done
for name in closeup movie; do
   "$PYTHON" -m gimp3d $name out/notebook_24 >$name.log 2>&1 || { cat $name.log; fail "gimp3d-post $name"; }
done
"$PYTHON" -c '
import sys
from PIL import Image
picture, movie = Image.open("out/notebook_24/closeup.png"), Image.open("out/notebook_24/movie.gif")
sys.exit(0 if min(picture.size) > 300 and len(picture.getcolors(10**7)) > 1000 and movie.n_frames > 1 else "pictures")' ||
   fail 'the pictures'
