#!/bin/sh
#test: long
#test: limit 1800
# Cases of the book of benchmarks on their coarse grids, with bounds: layers, films, a cone in metal.
. "$(dirname "$0")/../harness/env.sh"
cp "$ROOT/doc/user/benchmarks.md" document.md
"$PYTHON" -m gimp3d benchmarks --document document.md --program "$GIMP3D" --ranks 2 --grids coarse \
   layer_sphere layer_cone layer_punch film_punch_2 film_punch_0_5 cone_100_0 impact pyramid_85 || fail 'make benchmarks'
"$PYTHON" "$ROOT/test/indentation/benchmarks_bounds.py" document.json
