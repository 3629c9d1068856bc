#!/bin/bash
#test: beside
#test: limit 120
# The page of a run (post/gimp3d/report.py), taken apart without a browser: every picture is there and whole, the numbers are the run's, texts
# stand as they are, and what a run lacks is said. browser.sh opens the same pages.
. "$(dirname "$0")/../harness/env.sh"
here=$ROOT/test/report

report() { "$PYTHON" -m gimp3d report "$@" >report.log 2>&1; }

"$GIMP3D" <"$here/hostile.nml" >run.log 2>&1 || { cat run.log; fail 'the run'; }
copy() { # copy NAME: the run without its page
   cp -r run "$1"
   rm -f "$1/report.html" "$1"/hardness*.json
}
copy killed
sed -i '/^finished: /,$d' killed/run.log
rm killed/cost.dat
grep -q '^step ' killed/run.log || echo 'step 9   time 1 ns of 6 ns   17 %' >>killed/run.log
copy tecplot
sed -i "s/formats='hdf5'/formats='tecplot'/" tecplot/case.nml
rm tecplot/particles*
touch tecplot/particles_00000000.dat
mkdir bare
cp run/case.nml bare
copy caseless
rm caseless/case.nml
copy broken
sed -i '8s/^ *\([^ ]*\) .*/\1/' broken/tool_cone.dat
sed -i '$s/  *[^ ]*/  NaN/2' broken/energy.dat
echo '{"max_depth": ' >broken/hardness.json
for file in broken/particles_*.hdf; do echo 'no HDF5' >"$file"; done
copy older
rm older/*.dat
cp older/particles_00000000.hdf older/particles_99999999.hdf
copy alarmed
{
   sed '/^finished: /,$d' run/run.log
   echo 'retry 1: planted; rolls back to step 0, continues with 1/2 of the time step'
   echo 'range      particles are compressed by 40 %: fixed domains overlap'
   sed -n '/^finished: /,$p' run/run.log | sed 's/^guard: .*/guard: 1 retry, the last at time 1 ns/'
   echo 'WARNING: energy loss: up to 1 J, 30 % of the largest'
} >alarmed/run.log
rm alarmed/particles*
sed -i 's/^AUXDATA retries=.*/AUXDATA retries="1"/; s/^AUXDATA energy_balance_error_J=.*/AUXDATA energy_balance_error_J="0.3"/; s/^AUXDATA largest_energy_J=.*/AUXDATA largest_energy_J="1"/' \
   alarmed/cost.dat
sed "s:'out':'fault':; s/\&guard.*//" "$ROOT/test/regression/leaving.nml" >fault.nml
status=0
"$GIMP3D" <fault.nml >fault.log 2>&1 || status=$?
[ $status -eq 3 ] || fail "the run with a fault ended with $status"
echo '{"max_depth": 50e-9, "hardness_true": 9.5e9, "hardness_true_uncertainty": 2e8, "area_true": 2.5e-12, "pile_up": null,
"missing": ["The unloaded surface is missing: no snapshot."]}' >run/hardness.json
echo '{"max_depth": 70e-9, "unloadings": [{"max_depth": 40e-9, "hardness_true": 6e9, "hardness_true_uncertainty": 5e8},
{"max_depth": 70e-9, "hardness_true": null}]}' >run/hardness_other.json

cp -r run stale
touch -d '2000-01-01' stale/hardness*.json

for run in run killed tecplot bare caseless broken older alarmed fault stale; do
   report "$run" || { cat report.log; fail "the report of $run"; }
   grep -q "^$run/report.html$" report.log || fail "the report of $run is not named"
   if ls "$run"/.*.part 2>/dev/null; then fail "a partial page was left in $run"; fi
done
"$PYTHON" "$here/report.py" "$ROOT"

# the reader of pages must see what is wrong
plant() { # plant FAULT SED
   sed "$2" run/report.html >planted.html
   if "$PYTHON" -c 'import sys; from page import Page; sys.exit("; ".join(Page("planted.html").faults))' \
      2>planted.log; then fail "not noticed: $1"; fi
   grep -q -- "$1" planted.log || { cat planted.log; fail "not noticed in these words: $1"; }
}
plant 'is none' 's/iVBORw0KGgo[^"]\{200\}/iVBORw0KGgo/'
plant 'needs something from outside' 's:<main>:<main><img src="http\://example.org/x.png" alt="x">:'
plant 'has a handler' 's/<main>/<main onclick="x()">/'
plant 'closes' 's:</main>::'
plant 'leads nowhere' 's/id="worth"/id="worthless"/'
plant 'has no place' 's/id="chart-energy"/id="chart"/'

# a directory without a run: status 2, one sentence, nothing written
mkdir empty
for directory in empty absent; do
   status=0
   report "$directory" || status=$?
   [ $status -eq 2 ] || fail "status $status for a directory that is $directory"
   [ "$(wc -l <report.log)" -eq 1 ] && grep -q "^report: $directory: " report.log || { cat report.log; fail "the sentence for $directory"; }
done
[ -z "$(ls -A empty)" ] || fail 'something was written where there is no run'
status=0
report --finite-elements absent.csv run || status=$?
[ $status -eq 2 ] && grep -q 'absent.csv' report.log || { cat report.log; fail "status $status for a reference that is not there"; }
