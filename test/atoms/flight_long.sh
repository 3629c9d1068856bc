#!/bin/bash
#test: long
#test: limit 900
# Momentum, and the drift of the energy, over 2 x 10^4 steps of atoms: the flight of test/atoms/patch.f90
# for 1050 steps of the grid.
. "$(dirname "$0")/../harness/env.sh"
cd "$ROOT" && exec "$BUILD_DIR/test/atoms/patch" 1050
