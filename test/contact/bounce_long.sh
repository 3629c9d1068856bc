#!/bin/sh
#test: long
#test: limit 900
# What a coarse impact costs, by cells an edge: the table of doc/user/accuracy.md, Coarse impacts (bounce.py).
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/contact/bounce.py"
