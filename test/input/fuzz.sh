#!/bin/bash
# Scenes made by a fuzzer that is led by what the reader's branches do with them:   fuzz.sh [SECONDS]
#
# Seeds are the shipped scenes and the one of the input tests, its words the names that can be read. It ends with status 1 where a
# scene crashed the reader, kept it busy for a second, or was accepted and did not read back as it was written.
#test: helper
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
seconds=${1:-600}
reader=${READER:-$root/build/fuzz/test/input/read_quickly}
work=${WORK:-$root/build/fuzz/found}
command -v afl-fuzz >/dev/null || { echo "afl-fuzz is not there: apt-get install afl++"; exit 1; }
[ -x "$reader" ] || { echo "$reader is not there: make fuzz"; exit 1; }
rm -rf "$work" && mkdir -p "$work/seeds" || exit 1
cp "$root"/input/*.nml "$here/cases/good.nml" "$work/seeds"
"$(dirname "$reader")/read_scene" --names | tr ' ' '\n' | sort -u | sed 's/.*/"&"/' >"$work/words"
[ "$(wc -l <"$work/words")" -gt 50 ] || { echo "the names that can be read are missing"; exit 1; }
unset ASAN_OPTIONS
export AFL_NO_UI=1 AFL_NO_AFFINITY=1 AFL_SKIP_CPUFREQ=1 AFL_I_DONT_CARE_ABOUT_MISSING_CRASHES=1 AFL_HANG_TMOUT=1000
afl-fuzz -V "$seconds" -t 2000 -m none -x "$work/words" -i "$work/seeds" -o "$work" -- "$reader" >"$work/log" 2>&1
status=$?
facts=$work/default/fuzzer_stats
[ -s "$facts" ] || { tail -n 20 "$work/log"; exit 1; }
fact() { sed -n "s/^$1 *: *//p" "$facts"; }
echo "$(fact run_time) s, $(fact execs_done) scenes, $(fact edges_found) branches reached, $(fact corpus_count) scenes that reached new ones"
echo "$(fact saved_crashes) crashes, $(fact saved_hangs) hangs$(ls "$work"/default/crashes/id* "$work"/default/hangs/id* 2>/dev/null | sed 's/^/\n   /' | tr -d '\r')"
[ "$status" -eq 0 ] && [ "$(fact saved_crashes)" -eq 0 ] && [ "$(fact saved_hangs)" -eq 0 ] && [ "$(fact execs_done)" -ge 1000 ]
