#!/bin/sh
#test: beside check
# Friction whose shear stress is limited, under a tool and between bodies, against the exact force.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/contact/shear_limit.py"
