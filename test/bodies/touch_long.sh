#!/bin/bash
#test: long
#test: limit 600
#test: beside
# First touch at more places, in more directions, with domains that follow the material.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/bodies/touch.py" spheres_long on_block_long blocks_long corners
