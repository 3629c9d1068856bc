#!/bin/sh
#test: limit 3600
#test: long
# The debug build: bounds of arrays, addresses, undefined behaviour, exceptions of the arithmetic. Unit tests, the reader, files, and a run
# of each kind. `make test` has a part of it, regression/debug: compiling all takes some 250 s of a processor.
. "$(dirname "$0")/../harness/env.sh"
suites='unit input io regression/margins regression/quarter contact/bounded contact/end_of_a_beam statics/equilibrium restart/same_bits'
cd "$ROOT"
make BUILD=debug SETUP=no PYTHON="$PYTHON" "-j$(nproc)" tests TESTS="$suites" >"$WORK/build.log" 2>&1 || { tail "$WORK/build.log"; fail 'the debug build'; }
# shellcheck disable=SC2086 # a list of suites
env -u GIMP3D -u BUILD_DIR -u WORK BUILD=debug test/run $suites || fail 'the debug build'
