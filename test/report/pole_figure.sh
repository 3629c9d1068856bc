#!/bin/sh
#test: beside
#test: limit 60
# Pole figures: made-up orientations, whose components and densities are known; mistakes.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/report/pole_figure.py" "$ROOT"
refused() { # WORD COMMAND...: status 2 and one sentence that has the word
   word=$1
   shift
   status=0
   "$@" >said 2>&1 || status=$?
   [ $status -eq 2 ] && [ "$(wc -l <said)" -eq 1 ] && grep -q "$word" said || { cat said; fail "status $status: $*"; }
}
mkdir empty
refused 'snapshots' "$PYTHON" -m gimp3d pole_figure empty
mkdir unlisted
touch unlisted/particles_00000000.hdf
refused 'there is no particles.xdmf' "$PYTHON" -m gimp3d pole_figure unlisted
echo '<DataItem>particles_00000007.hdf:/VTKHDF/Points</DataItem>' >unlisted/particles.xdmf
refused 'lists particles_00000007.hdf, which is not there' "$PYTHON" -m gimp3d pole_figure unlisted
refused 'three digits' "$PYTHON" -m gimp3d pole_figure --pole 11 empty
refused 'two axes' "$PYTHON" -m gimp3d pole_figure --rolling z empty
