#!/bin/sh
#test: limit 120
#test: beside
# The debug build of a part: kernels, their lists, points on faces, with bounds of arrays, addresses, undefined behaviour and
# exceptions of the arithmetic looked at. Only what these tests use is compiled (14 s of a processor); the rest is in debug_long.
. "$(dirname "$0")/../harness/env.sh"
tests='unit/corners unit/face_weights contact/bounded'
[ "$BUILD" != debug ] || { echo 'the debug build runs all tests so'; exit 0; }
cd "$ROOT"
compile() { # compile OBJECT...
   env -u MAKEFLAGS make BUILD=debug SETUP=no PYTHON="$PYTHON" build/debug/flags "$@" >"$WORK/build.log" 2>&1 ||
      { tail "$WORK/build.log"; fail 'the debug build'; }
}
# shellcheck disable=SC2046 # lists of files
compile $(for name in $tests; do echo "build/debug/obj/test/$name.o"; done)
# parts of modules that are there, which nothing uses by name
compile $(grep -riE '^ *submodule' src --include='*.f90' | sed 's/^\(.*\)\.f90:.*( *m_\([a-z_]*\).*/\2 \1/' | while read -r whole part; do
   [ -z "$(find build/debug/obj/src -name "$whole.o")" ] || echo "build/debug/obj/$part.o"
done)
# of an archive the linker takes what a test uses; programs are none of it
find build/debug/obj/src -name '*.o' -exec ar rcs "$WORK/all.a" {} +
grep -rLiE '^ *program +[a-z]' test --include='*.f90' | sed 's|\(.*\)\.f90|build/debug/obj/\1.o|' |
   while read -r object; do [ ! -f "$object" ] || ar rcs "$WORK/all.a" "$object"; done
link=$(sed -n 1p build/debug/flags) libraries=$(sed -n 2p build/debug/flags)
# shellcheck disable=SC2086 # words
for name in $tests; do
   program=$WORK/$(basename "$name")
   eval "$link -o '$program' build/debug/obj/test/$name.o '$WORK/all.a' $libraries" || fail "the debug build of $name"
   mpirun -n 1 "$program" >"$program.log" 2>&1 || { tail -n 20 "$program.log"; fail "$name in the debug build"; }
done
# its flags do look: an access beyond an array's end stops the program
printf 'program beyond\n   integer :: list(3), n\n   n = command_argument_count() + 4\n   list(n) = 1\n   print *, list\nend program beyond\n' \
   >"$WORK/beyond.f90"
eval "$link -o '$WORK/beyond' '$WORK/beyond.f90'" || fail 'the flags of the debug build'
if "$WORK/beyond" >"$WORK/beyond.log" 2>&1; then fail 'an access beyond an array was not noticed'; fi
grep -q 'list' "$WORK/beyond.log" || fail 'an access beyond an array was not told'
