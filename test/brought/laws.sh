#!/bin/sh
#test: beside
# Five VUMATs in the forms in which people have them, against the built-in laws.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
for file in "$ROOT"/test/brought/laws/*; do
   name=$(basename "$file" | sed 's/free$/f90/') # so that the Makefile takes none for a test program
   cp "$file" "$name"
   make -s -C "$ROOT" vumat FILE="$PWD/$name" >/dev/null || fail "make vumat FILE=$name"
done
"$PYTHON" "$ROOT/test/brought/laws.py"
