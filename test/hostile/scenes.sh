#!/bin/sh
#test: beside
# Scenes changed at random: accepted or refused, never a signal, never a hang. One of them (1655) once had no solution of its contact found.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/hostile/scenes.py" 40 1630
