#!/bin/sh
#test: beside
# `make error_bar` on made-up answers whose limit is known, and on runs that are not of one problem.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/error_bar.py" "$ROOT" "$WORK"

make -s -C "$ROOT" error_bar RUNS="$WORK/fine $WORK/coarse" PYTHON="$PYTHON" >make.log 2>&1 || { cat make.log; fail 'make error_bar'; }
grep -q '1, assumed' make.log || { cat make.log; fail 'make error_bar does not hand its RUNS on'; }
if make -s -C "$ROOT" error_bar PYTHON="$PYTHON" >make.log 2>&1; then fail 'make error_bar needs no RUNS'; fi
grep -q 'make error_bar RUNS=' make.log || fail 'make error_bar does not say that it needs RUNS'
