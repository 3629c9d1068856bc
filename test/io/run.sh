#!/bin/bash
#test: beside check
#test: limit 300
# Writes snapshots, curves, console and cost report on 1, 2, 4 ranks and reads them with other programs' readers (where ParaView is
# installed, also with its own), planted failures too; runs scenes with levels and without output. BINARIES=directory takes the test
# programs from elsewhere. Last line: the sum; exit status 0 if nothing failed.
. "$(dirname "$0")/../harness/env.sh"
BINARIES=${BINARIES:-$BUILD_DIR/test/io}
set +e
passed=0 failed=0

count() { # count NAME STATUS
   if [ "$2" -eq 0 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "FAILED: $1"; fi
}

for test in text probes; do
   mpirun -n 1 "$BINARIES/$test"
   count $test $?
done
written=''
for n in $RANKS; do
   for test in snapshots histories; do
      timeout 120 mpirun -n "$n" "$BINARIES/$test" "ranks_$n"
      count "$test on $n" $?
   done
   written="$written ranks_$n"
done
for n in 1 2; do
   mkdir -p "bare_$n"
   (cd "bare_$n" && run_scene "$n" "$ROOT/test/io/no_output.nml" ../bare.log && [ -z "$(ls -A)" ]) && grep -q '^finished: ' bare.log &&
      grep -q '^warning  *no &output: this run writes no files' bare.log
   status=$?
   [ $status -eq 0 ] || cat bare.log
   count "a scene without &output on $n" $status
done
for n in 1 2; do
   sed "s:'out':'levels_$n':" "$ROOT/test/io/levels.nml" >levels.nml
   run_scene "$n" levels.nml "levels_$n.log"
   status=$?
   [ $status -eq 0 ] || cat "levels_$n.log"
   count "a scene with levels on $n" $status
done
"$PYTHON" "$ROOT/test/io/levels.py" levels_1 levels_2 levels_1.log
count levels.py $?
"$PYTHON" "$ROOT/test/io/read_back.py" $written >read_back.log 2>&1
count 'read_back.py' $?
sum=$(tail -n 1 read_back.log)
if [[ $sum =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed$ ]]; then
   passed=$((passed + BASH_REMATCH[1])) failed=$((failed + BASH_REMATCH[2]))
   grep '^FAILED' read_back.log
else
   cat read_back.log
fi
if command -v pvpython >/dev/null; then
   pvpython --force-offscreen-rendering "$ROOT/test/io/by_paraview.py" "$PWD/ranks_1" "$PWD/ranks_2"
   count by_paraview.py $?
else
   echo 'pvpython is not there: ParaView itself was not asked, only the readers of vtk'
fi
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
