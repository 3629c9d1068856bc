#!/bin/sh
#test: limit 3600
#test: long
# The debug build: bounds of arrays, addresses, undefined behaviour, exceptions of the arithmetic. Unit tests, the reader, files, and a run
# of each kind. Not in `make test`: compiling alone takes some 190 s of a processor, and no part of the sources stands for the others.
. "$(dirname "$0")/../harness/env.sh"
suites='unit input io regression/margins regression/quarter contact/bounded contact/end_of_a_beam statics/equilibrium restart/same_bits'
cd "$ROOT"
make BUILD=debug SETUP=no PYTHON="$PYTHON" "-j$(nproc)" tests TESTS="$suites" >"$WORK/build.log" 2>&1 || { tail "$WORK/build.log"; fail 'the debug build'; }
# shellcheck disable=SC2086 # a list of suites
env -u GIMP3D -u BUILD_DIR -u WORK BUILD=debug test/run $suites || fail 'the debug build'
# its flags do look: an access beyond an array's end stops the program
printf 'program beyond\n   integer :: list(3), n\n   n = command_argument_count() + 4\n   list(n) = 1\n   print *, list\nend program beyond\n' \
   >"$WORK/beyond.f90"
eval "$(sed -n 1p build/debug/flags) -o '$WORK/beyond' '$WORK/beyond.f90'" || fail 'the flags of the debug build'
if "$WORK/beyond" >"$WORK/beyond.log" 2>&1; then fail 'an access beyond an array was not noticed'; fi
grep -q 'list' "$WORK/beyond.log" || fail 'an access beyond an array was not told'
