#!/bin/bash
#test: limit 120
# The tools of the tests must notice what is wrong: every failure planted here has to be caught.
. "$(dirname "$0")/../harness/env.sh"

planted=$BUILD_DIR/test/harness/planted
caught=0

must_pass() { # must_pass WHAT COMMAND...
   what=$1
   shift
   "$@" >out.log 2>&1 || { cat out.log; fail "$what does not pass"; }
}

must_fail() { # must_fail WHAT EXPECTED-TEXT COMMAND...
   what=$1 text=$2
   shift 2
   if "$@" >out.log 2>&1; then fail "not noticed: $what"; fi
   grep -qF -- "$text" out.log || { cat out.log; fail "$what: nothing says '$text'"; }
   caught=$((caught + 1))
}

# ---- assertions ----
must_pass 'a sound test program' "$planted" none
must_pass 'a sound test program on 2 ranks' mpirun -n 2 "$planted" none
for plant in condition value nan nan-expected array length count; do
   must_fail "$plant in an assertion" ', 1 failed' "$planted" $plant
done
must_fail 'a failure on the last rank' 'rank 1' mpirun -n 2 "$planted" last-rank
grep -q 'planted: 5 cases, 10 checks on 2 ranks, 1 failed' out.log || fail 'a case counts more than once'
must_fail 'a program that checks nothing' 'nothing was checked' "$planted" nothing

# ---- compare.py ----
"$PYTHON" "$ROOT/test/harness/planted.py" >compare.log 2>&1 || { cat compare.log; fail 'compare.py'; }
cat compare.log

# ---- the driver: a copy of it runs a suite with a sound, a failing, a hanging and a missing test ----
mkdir -p driver/test/unit driver/test/harness
cp "$ROOT/test/run" driver/test/run
cp "$ROOT/test/harness/mpi.sh" driver/test/harness/
echo 'exit 0' >driver/test/unit/sound.sh
driver() { env -u WORK PYTHON="$PYTHON" BUILD=opt driver/test/run "$@"; }
must_pass 'a suite of one sound test' driver
[ "$(tail -n 1 out.log)" = '1 passed, 0 failed' ] || fail 'the last line of the driver'
printf '#test: long\nexit 1\n' >driver/test/unit/later.sh
must_pass 'a long test left out' driver
must_pass 'a list' driver --list
[ "$(awk '{ print $1, $4 }' out.log)" = "$(printf 'unit/later long\nunit/sound ')" ] || { cat out.log; fail 'the list of tests'; }
must_fail 'a long test that fails' '1 passed, 1 failed' driver --all
rm driver/test/unit/later.sh
echo 'exit 3' >driver/test/unit/failing.sh
must_fail 'a failing test' '1 passed, 1 failed' driver
printf '#test: beside\nexit 3\n' >driver/test/unit/failing.sh
must_fail 'a failing test beside others' '1 passed, 1 failed' driver
nowhere() { OMPI_MCA_orte_tmpdir_base=$PWD/nowhere driver; }
must_fail 'a test that ends without a result' '1 of 2 tests ended without a result' nowhere
rm driver/test/unit/failing.sh
cat >driver/test/unit/launcher.sh <<'END'
echo '[vm:1] [ 4] mpirun(+0x13b9)[0x55d23a0c43b9]'
echo '[vm:1] [ 5] /lib/x86_64-linux-gnu/libc.so.6(+0x2724a)[0x7f82ef84a24a]'
[ -f crashed_before ] || { touch crashed_before; exit 139; }
END
must_pass 'a test in which the launcher crashed once' driver
grep -q 'again unit/launcher: mpirun itself crashed' out.log || fail 'nothing says that the launcher crashed'
rm driver/crashed_before
sed -i 's/^echo .*mpirun.*/&\necho "[vm:2] [ 3] gimp3d(main+0x2f)[0x55]"/' driver/test/unit/launcher.sh
must_fail 'a test in which the program crashed once' '1 passed, 1 failed' driver
rm driver/crashed_before driver/test/unit/launcher.sh
printf '#test: limit 1\nsleep 30\n' >driver/test/unit/hanging.sh
must_fail 'a hanging test' 'stopped at its limit' driver
rm driver/test/unit/hanging.sh
printf 'until [ -f begun ]; do sleep 0.1; done\n' >driver/test/unit/waiting.sh
driver >first.log 2>&1 &
until [ -s driver/build/opt/test/log/runs ]; do sleep 0.1; done
must_fail 'a second run beside the first' "process $(cat driver/build/opt/test/log/runs), is going on" driver
touch driver/begun
wait $! || { cat first.log; fail 'the first of two runs does not pass'; }
[ "$(tail -n 1 first.log)" = '2 passed, 0 failed' ] || fail 'a second run disturbed the first'
rm driver/test/unit/waiting.sh
printf '!test: ranks 1 2\nprogram absent\nend program\n' >driver/test/unit/absent.f90
must_fail 'programs that were not built' '1 passed, 2 failed' driver
must_fail 'a suite that does not exist' 'no suite' driver units
must_fail 'a word that it does not know' '--list' driver --lots
must_fail 'a test that does not exist' 'No test was run' driver unit/soundly

echo "assertions and driver: $caught planted failures caught"
