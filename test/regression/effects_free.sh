#!/bin/bash
#test: beside check
#test: limit 60
# What a scene does not call for is free: small scenes carry exactly the columns they need, enter exactly the rows of cost.dat that
# they need and as often as they must, write no other files, and start PETSc only for a tool. Failures planted here must be caught.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/regression/effects_free.py"
