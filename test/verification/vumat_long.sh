#!/bin/sh
#test: long
#test: limit 300
# E5, on one grid and on two levels, with the VUMAT that comes with it in place of model='j2'.
. "$(dirname "$0")/../harness/env.sh"
cp "$ROOT/input/vumat/j2.f" .
make -s -C "$ROOT" vumat FILE="$PWD/j2.f" >/dev/null || fail "make vumat FILE=j2.f"
"$PYTHON" "$ROOT/test/verification/vumat_long.py"
