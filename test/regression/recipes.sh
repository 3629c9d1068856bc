#!/bin/sh
#test: beside
# The recipes of packaging/ name what tools/deps looks for, and make install puts there what they run.
. "$(dirname "$0")/../harness/env.sh"
cd "$ROOT"
for package in gfortran openmpi-bin libopenmpi-dev pkg-config libpetsc-real-dev libhdf5-openmpi-dev libmetis-dev; do
   grep -q "need $package " tools/deps || fail "tools/deps does not know $package"
   for recipe in packaging/Dockerfile packaging/gimp3d.def; do
      grep -q " $package" "$recipe" || fail "$recipe lacks $package"
   done
done
"$PYTHON" -m py_compile packaging/spack/package.py || fail 'spack/package.py is no Python'
rm -rf packaging/spack/__pycache__
for name in mpi petsc hdf5 metis; do
   grep -q "depends_on(\"$name" packaging/spack/package.py || fail "Spack's recipe lacks $name"
done
for name in openmpi petsc hdf5 metis; do grep -q "  - $name" packaging/conda/recipe.yaml || fail "conda's recipe lacks $name"; done
if "$PYTHON" -c 'import rattler_build' 2>/dev/null; then
   "$PYTHON" - packaging/conda/recipe.yaml <<'END' || fail "rattler-build does not take conda's recipe"
import sys
from rattler_build import Stage0Recipe, VariantConfig
rendered = Stage0Recipe.from_file(sys.argv[1]).render(VariantConfig())
assert len(rendered) == 1, rendered
END
fi
for name in build out config.mk; do grep -qx "$name" .dockerignore || fail ".dockerignore lacks $name: it would be copied"; done
version=$(sed -n "s/.*program_version = '\(.*\)'/\1/p" src/base/constants.f90)
grep -q "version: \"$version\"" packaging/conda/recipe.yaml || fail "conda's recipe is not of version $version"
make -s install SETUP=no BUILD="$BUILD" DESTDIR="$WORK/image" >/dev/null || fail 'make install'
"$WORK/image/usr/local/bin/gimp3d" --version | grep -q "$version" || fail 'the installed program has another version'
"$WORK/image/usr/local/bin/gimp3d" --plan "$WORK/image/usr/local/share/gimp3d/input/hertz.nml" >"$WORK/plan" || fail 'no plan'
[ -e "$WORK/image/usr/local/share/gimp3d/input/die.stl" ] || fail 'the die of rod_die.nml is not installed'
[ -e "$WORK/image/usr/local/share/gimp3d/tools/vumat/utilities.f" ] || fail 'tools/vumat is not installed'
"$GIMP3D" --schema >"$WORK/schema.json" || fail 'no schema'
"$PYTHON" - "$WORK/schema.json" doc/user/input.md <<'END' || fail 'the schema and doc/user/input.md differ'
import json, re, sys
schema = json.load(open(sys.argv[1]))["properties"]
there = set()
for group, entry in schema.items():
    while "anyOf" in entry:
        entry = entry["anyOf"][0]
    there |= {(group, name) for name in entry["properties"]}
rows = set(re.findall(r"^\| *`(\w+)` *\| *`(\w+)` *\|", open(sys.argv[2]).read(), re.M))
print(len(there), "variables; one side alone:", sorted(there ^ rows)[:10])
sys.exit(there != rows)
END
