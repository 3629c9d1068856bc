#!/bin/sh
#test: beside
#test: limit 120
# The book of benchmarks (doc/user/benchmarks.md): its references against their formulas, what it reads off runs that are known, the
# tables that it writes, and what it says to mistakes.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/indentation/benchmarks.py" "$ROOT" "$WORK"

cp "$ROOT/doc/user/benchmarks.md" document.md
refused() { # WORD COMMAND...: status 2 and one sentence that has the word
   word=$1
   shift
   status=0
   "$@" >said 2>&1 || status=$?
   [ $status -eq 2 ] && [ "$(wc -l <said)" -eq 1 ] && grep -q "$word" said || { cat said; fail "status $status: $*"; }
}
refused 'no such case' "$PYTHON" -m gimp3d benchmarks --document document.md --no-run B99
refused 'coarse, fine and finer' "$PYTHON" -m gimp3d benchmarks --document document.md --grids rough --no-run B1
refused 'no such program' "$PYTHON" -m gimp3d benchmarks --document document.md --program ./none B10
echo 'no place' >empty.md
refused 'has no lines' "$PYTHON" -m gimp3d benchmarks --document empty.md --no-run B10
[ "$(cat empty.md)" = 'no place' ] || fail 'a document without a place for tables was written to'
