#!/bin/sh
#test: long
#test: beside
#test: limit 600
# `make api`: a page for each module of src.
. "$(dirname "$0")/../harness/env.sh"
packages=$ROOT/doc/developer/requirements.txt
if ! "$PYTHON" -m pip install --quiet --disable-pip-version-check -r "$packages" >pip.log 2>&1; then
   echo 'left out: ford is not there, and cannot be installed'
   exit 0
fi
make -s -C "$ROOT" api >api.log 2>&1 || { cat api.log; fail 'make api'; }
[ -s "$ROOT/build/api/index.html" ] || fail 'no index'
missing=0
for module in $(sed -n 's/^module \(m_[a-z0-9_]*\).*/\1/p' "$ROOT"/src/*/*.f90 "$ROOT"/src/*/*.F90 | sort -u); do
   [ -s "$ROOT/build/api/module/$module.html" ] || { echo "no page of $module"; missing=$((missing + 1)); }
done
[ $missing = 0 ] || fail "$missing modules have no page"
