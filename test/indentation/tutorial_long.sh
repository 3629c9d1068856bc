#!/bin/bash
#test: long
#test: limit 1800
# Every command of the tutorials, in order, from the documents, in a directory of its own; what is printed beside what they have. It may
# take 20 minutes.
. "$(dirname "$0")/../harness/env.sh"
tutorial() { "$PYTHON" "$ROOT/test/indentation/tutorial.py" "$@"; }
for part in Makefile mk post input src test tools doc build; do ln -s "$ROOT/$part" "$part"; done
ln -s "$GIMP3D" gimp3d
if [ -f "$ROOT/config.mk" ]; then ln -s "$ROOT/config.mk" config.mk; fi
limit=$((1200 * ${SLOWER:-1}))
tutorial run "$ROOT/doc/user/tutorial.md" "$limit" || fail 'tutorial.md'
tutorial run "$ROOT/doc/user/tutorial_impact.md" "$limit" || fail 'tutorial_impact.md'

# negative controls, on what is there already: a wrong option, a wrong number, a run that is not there
must_fail() { # must_fail WORDS COMMAND [PRINTED]
   { echo '```sh'; echo "$2"; echo '```'; if [ "${3:-}" ]; then echo '```text'; printf "$3"; echo '```'; fi; } >planted.md
   if tutorial run planted.md >planted.log; then fail "not noticed: $2"; fi
   grep -q -- "$1" planted.log || { cat planted.log; fail "noticed, but not told: $1"; }
}
must_fail 'status 2: make hardness' 'make hardness RUN=out/tutorial/cone OPTIONS="--windows 20"'
must_fail 'status 2: make hardness' 'make hardness RUN=out/tutorial/cones'
must_fail 'the document has' 'make hardness RUN=out/tutorial/cone OPTIONS=--no-plots' '...\n  largest depth h                    280 nm   +- 0.025       0.0094 %%\n'
