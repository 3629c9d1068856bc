#!/bin/sh
#test: beside
# All laws in one scene, with damage and erosion: the same bits on 1 and 2 ranks, and after going on from a checkpoint on the other.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/restart/laws.py"
