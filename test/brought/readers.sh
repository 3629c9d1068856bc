#!/bin/sh
#test: beside
# Columns in several units and forms, scales, layers, user blocks of HDF5, faces above corners: each is read right or refused.
#test: limit 60
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/brought/readers.py"
