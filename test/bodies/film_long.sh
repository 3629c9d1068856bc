#!/bin/bash
#test: long
#test: limit 3000
#test: beside
# A sphere pressed into a film on a softer base, bonded and free to slide, beside the exact integral equation.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/film.py" film_long
