#!/bin/sh
#test: beside
# Eight small scenes made by chance: laws of mechanics, and the same seen otherwise. The five hundred are in random_truth_long.sh, those
# that were once wrong in once_wrong_long.sh.
#test: limit 300
. "$(dirname "$0")/../harness/env.sh"
truth="$ROOT/test/invariants/random_truth.py"
# The judge can fail: in scenes that are right, with what a run says changed.
for planted in gain:8 work:8 mass:8 rod:6 momentum:12 twin:8 loss:8; do
   if "$PYTHON" "$truth" "$WORK/planted" "$GIMP3D" 1 --first "${planted#*:}" --planted "${planted%:*}" >planted.log; then
      fail "seed ${planted#*:}: nobody sees ${planted%:*}"
   fi
   grep -q '^FAILED: seed' planted.log || fail "seed ${planted#*:}: $(cat planted.log)"
done
# Implicit steps: all but 1.5 % of the energy is booked, and 3 % are seen.
"$PYTHON" "$truth" "$WORK/books" "$GIMP3D" 1 --mixtures --first 45 >books.log || fail "seed 45: $(cat books.log)"
if "$PYTHON" "$truth" "$WORK/books" "$GIMP3D" 1 --mixtures --first 45 --planted books >books.log; then
   fail 'seed 45: nobody sees 3 % of the work'
fi
"$PYTHON" "$truth" "$WORK/scenes" "$GIMP3D" 8 || fail 'see above'
"$PYTHON" "$truth" "$WORK/sections" "$GIMP3D" 4 --sections || fail 'see above'
# All parts together.
"$PYTHON" "$truth" "$WORK/mixtures" "$GIMP3D" 1 --mixtures --first 8 || fail 'see above'
