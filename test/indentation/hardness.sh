#!/bin/sh
#test: beside
#test: limit 180
# `make hardness` on fabricated runs whose numbers are known, and on runs that lack something.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/hardness.py" "$ROOT" "$WORK"

make -s -C "$ROOT" hardness RUN="$WORK/two" TOOL=other OPTIONS="--beta 1.1 --epsilon 0.72" PYTHON="$PYTHON" >make.log 2>&1 ||
   { cat make.log; fail 'make hardness'; }
grep -q '^  beta  *1.1 ' make.log || { cat make.log; fail 'make hardness does not hand its OPTIONS on'; }
[ -s two/hardness_other.json ] || fail 'make hardness does not hand its TOOL on'
if make -s -C "$ROOT" hardness PYTHON="$PYTHON" >make.log 2>&1; then fail 'make hardness needs no RUN'; fi
grep -q 'make hardness RUN=' make.log || fail 'make hardness does not say that it needs a RUN'
