#!/bin/bash
#test: beside
#test: limit 120
# The examples of doc/developer/extending.md, taken out of that text into a copy of the tree: one new file and one line for a law, an effect, a shape, a law
# of friction and a format of snapshots, two files changed for a number that a run keeps, nothing else; it builds, and scenes that name them give the known
# answers. With a field planted there that no effect was called for, the test effects_free must fail.
. "$(dirname "$0")/../harness/env.sh"
unset MAKEFLAGS MFLAGS MAKELEVEL MAKEOVERRIDES
mkdir -p tree/build/"$BUILD"/obj
cp -a "$ROOT/src" "$ROOT/tools" "$ROOT/Makefile" "$ROOT/mk" tree/
[ ! -e "$ROOT/config.mk" ] || cp -a "$ROOT/config.mk" tree/
# what is built already, with its times: only what the example touches is compiled
cp -a "$BUILD_DIR"/{mod,flags,depends.mk,libgimp3d.a} tree/build/"$BUILD"/
cp -a "$BUILD_DIR/obj/src" tree/build/"$BUILD"/obj/

"$PYTHON" "$ROOT/test/regression/extending.py" extract "$ROOT/doc/developer/extending.md" tree
diff -r "$ROOT/src" tree/src >differences || true
cat >wanted <<'END'
Only in tree/src/effects: shaking.f90
Only in tree/src/friction: cohesive.f90
Only in tree/src/geometry: torus.f90
Only in tree/src/io: csv_snapshot.f90
Only in tree/src/laws: kelvin_voigt.f90
END
grep '^Only in' differences | cmp - wanted || fail "other new files: $(cat differences)"
lists=$(awk '/^(diff|Only)/ {other = /model\/(energy|state).f90/} !other' differences)
[ "$(grep -c '^diff ' differences)" -eq 7 ] && [ "$(grep -c '^> ' <<<"$lists")" -eq 5 ] && ! grep -q '^< ' <<<"$lists" ||
   fail "more than a line in each list, and two files: $(cat differences)"
grep '^> ' <<<"$lists" | grep -v 'use m_\(kelvin_voigt\|shaking\|torus\|cohesive\|csv_snapshot\)' && fail 'another line'
echo "   differs: $(wc -l <wanted) new files, $(grep -c '^> ' <<<"$lists") lines of lists, 2 files changed"

sed -i "s/^\( *\)call table%declare('stress', .*/\1call table%declare('planted', 1, '1', written=.false.)\n&/" \
   tree/src/model/model_building.f90
! cmp -s "$ROOT/src/model/model_building.f90" tree/src/model/model_building.f90 || fail 'nothing was planted'
make -C tree BUILD="$BUILD" >build.log 2>&1 || fail "the tree does not build: $(tail -n 30 build.log)"
echo "   built: $(grep -c '^  compile' build.log) files compiled"
status=0
"$GIMP3D" <example.nml >refused.log 2>&1 || status=$?
[ $status -eq 2 ] || fail "the program without the example ends with status $status"
with_example=$PWD/tree/build/$BUILD/gimp3d
"$with_example" <example.nml >example.log 2>&1 || fail "the example ends with status $?: $(tail -n 3 example.log)"
"$PYTHON" "$ROOT/test/regression/extending.py" check out/example example.log
"$with_example" <ring.nml >ring.log 2>&1 || fail "the ring ends with status $?: $(tail -n 3 ring.log)"
"$PYTHON" "$ROOT/test/regression/extending.py" ring out/ring
"$with_example" <dragged.nml >dragged.log 2>&1 || fail "the dragged block ends with status $?: $(tail -n 3 dragged.log)"
"$PYTHON" "$ROOT/test/regression/extending.py" dragged out/dragged

timeout 60 "$with_example" <braked.nml >braked.log 2>&1 || fail "the braked block ends with status $?: $(tail -n 3 braked.log)"
sed -i 's/end_time=0.1/end_time=0.2/' braked.nml
timeout 60 mpirun -n 2 "$with_example" <braked.nml >braked2.log 2>&1 || fail "its second half ends with status $?: $(tail -n 3 braked2.log)"
"$PYTHON" "$ROOT/test/regression/extending.py" braked out/braked

if GIMP3D=$with_example WORK=$PWD/planted bash "$ROOT/test/regression/effects_free.sh" >planted.log 2>&1; then
   fail 'effects_free does not see a field that no one called for'
fi
grep -q "^FAILED: plain: fields: found .*'planted': 1" planted.log || fail "effects_free fails otherwise: $(head -n 5 planted.log)"
echo '   planted: a field that no one called for, found by effects_free'
