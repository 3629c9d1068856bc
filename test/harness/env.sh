# What every test script reads first:   . "$(dirname "$0")/../harness/env.sh"
# It sets -eu and gives
#   ROOT       the project's directory
#   GIMP3D     the program of the build under test
#   BUILD_DIR  where that build stands (absolute)
#   WORK       an empty directory of this script's own, and the current directory from here on
#   PYTHON     a Python with the packages that post/pyproject.toml names
#   RANKS      the numbers of ranks to try (mpirun takes 2 s to end when a program exits nonzero: run "$GIMP3D" by itself on 1)
# and the procedures below. A script that exits 0 passed. Its limits stand in comment lines, as in the test programs:
#   #test: limit 120      seconds (60 when nothing is said; five times as many in the debug build)
#   #test: long           only under `make test-all`
set -eu

ROOT=$(cd "$(dirname "$0")" && while [ ! -f Makefile ] && [ "$PWD" != / ]; do cd ..; done && pwd)
BUILD=${BUILD:-opt}
BUILD_DIR=$ROOT/build/$BUILD
GIMP3D=${GIMP3D:-$BUILD_DIR/gimp3d}
PYTHON=${PYTHON:-$ROOT/build/venv/bin/python}
RANKS=${RANKS:-1 2 4}
WORK=${WORK:-$BUILD_DIR/test/work/$(basename "$(dirname "$0")")-$(basename "$0" .sh)}

. "$ROOT/test/harness/mpi.sh"
export BUILD PYTHON GIMP3D

# what Python finds: the package, and the modules that tests of other folders share (a script's own folder comes first)
PYTHONPATH=$ROOT/post
for folder in harness regression verification stability restart bodies references/impact report; do PYTHONPATH=$PYTHONPATH:$ROOT/test/$folder; done
export PYTHONPATH

rm -rf "$WORK"
mkdir -p "$WORK"
cd "$WORK"

# run_scene RANKS FILE [LOG]: run a scene; the status is the program's
run_scene() {
   mpirun -n "$1" "$GIMP3D" <"$2" >"${3:-run_$1.log}" 2>&1
}

# compare [OPTIONS] REFERENCE RESULT: see compare.py
compare() {
   "$PYTHON" "$ROOT/test/harness/compare.py" "$@"
}

# fail SENTENCE...: the test failed
fail() {
   printf 'FAILED: %s\n' "$*" >&2
   exit 1
}
