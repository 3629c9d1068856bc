#!/bin/bash
#test: long
#test: beside
#test: limit 120
# The pictures of fabricated runs whose load is the theory's: the curves must lie on it, for the whole, half and quarter body.
. "$(dirname "$0")/../harness/env.sh"

plots() { "$PYTHON" -m gimp3d plots "$@" >out.log 2>&1; }

png() { # png FILE: a whole picture of some size
   [ "$(head -c 8 "$1" | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ] && [ "$(wc -c <"$1")" -gt 10000 ] ||
      fail "$1 is no picture"
   if ls "$(dirname "$1")"/.*.part 2>/dev/null; then fail 'a partial picture was left'; fi
}

for run in 'sphere 0.25 Hertz' 'cone 0.5 Sneddon' 'flat 1 flat.punch'; do
   read -r shape share theory <<<"$run"
   "$PYTHON" "$ROOT/test/harness/fabricate_run.py" "$shape" "$shape" "$share"
   plots "$shape" || { cat out.log; fail "pictures of the $shape"; }
   grep -q "$theory.*mean [+-]0.00%, largest 0.00%" out.log || { cat out.log; fail "the $shape's load is not $theory's"; }
   for picture in load_depth section energy; do png "$shape/$picture.png"; done
done

"$PYTHON" "$ROOT/test/harness/fabricate_run.py" levels sphere 0.25 levels
plots levels || { cat out.log; fail 'pictures of a run with levels'; }
png levels/section.png
if cmp -s levels/section.png sphere/section.png; then fail 'the edges of levels are not drawn'; fi

# a snapshot that the run's index does not name is an older run's
cp sphere/section.png at_the_end.png
echo '<Grid><DataItem>particles_00000000.hdf:/VTKHDF/Points</DataItem><DataItem>particles_00000900.hdf:/VTKHDF/Points</DataItem></Grid>' \
   >sphere/particles.xdmf
plots sphere || { cat out.log; fail 'pictures of a run with an older snapshot beside its own'; }
if cmp -s sphere/section.png at_the_end.png; then fail 'a snapshot of an older run is drawn'; fi
rm sphere/particles.xdmf

reference=$ROOT/test/references/fem/sphere_hypo_h0.1.csv
plots --finite-elements "$reference" sphere || { cat out.log; fail 'the reference curve'; }
grep -q 'finite elements (sphere_hypo_h0.1).*mean -[3-9]\.' out.log ||
   { cat out.log; fail 'half-space theory is 3 to 9 % below the elements'; }

if plots absent; then fail 'a run that is not there is drawn'; fi
mkdir empty
if plots empty; then fail 'an empty run is drawn'; fi
if plots --finite-elements absent.csv sphere; then fail 'a reference that is not there is drawn'; fi
grep -q 'absent.csv' out.log || fail 'the reference that is not there is not named'
sed -i '6s/ .*//' sphere/tool_tip.dat
if plots sphere; then fail 'a broken history is drawn'; fi
grep -q 'tool_tip.dat:6: 1 values for 7 columns' out.log || fail 'the broken line is not named'
