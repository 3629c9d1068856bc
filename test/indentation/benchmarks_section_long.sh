#!/bin/sh
#test: long
#test: limit 900
# Cases of the book of benchmarks by their section on coarse grids, with bounds: all that take some seconds.
. "$(dirname "$0")/../harness/env.sh"
cp "$ROOT/doc/user/benchmarks.md" document.md
"$PYTHON" -m gimp3d benchmarks --document document.md --program "$GIMP3D" --ranks 1 --grids coarse \
   B1a B2c sphere_elastic_section rounded_cone_section rounded_cone_5_section layer_punch_section \
   layer_sphere_section layer_cone_section film_punch_2_section film_sphere_2_section sphere_plastic_section \
   relaxing_section impact_section || fail 'make benchmarks'
"$PYTHON" "$ROOT/test/indentation/benchmarks_bounds.py" document.json section
