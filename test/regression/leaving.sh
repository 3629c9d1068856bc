#!/bin/bash
#test: beside check
#test: limit 60
# A particle that leaves the grid ends the run: status 3 and a sentence that names it and the side, on any number of ranks, with the
# histories so far.
. "$(dirname "$0")/../harness/env.sh"
scenes=$ROOT/test/regression
for n in 1 2 4; do
   sed "s:'out':'ranks_$n':" "$scenes/leaving.nml" >scene.nml
   status=0
   timeout 60 mpirun -n $n "$GIMP3D" <scene.nml >out_$n.log 2>err_$n.log || status=$?
   [ $status -eq 3 ] || { cat out_$n.log err_$n.log; fail "exit status $status on $n ranks, expected 3"; }
   sentence=$(grep '^gimp3d: ' err_$n.log) || { cat err_$n.log; fail "no sentence on $n ranks"; }
   [ "$(printf '%s\n' "$sentence" | wc -l)" -eq 1 ] || fail "more than one sentence on $n ranks: $sentence"
   [[ $sentence =~ step\ [0-9]+,\ time\ .*\ s:\ particle\ [0-9]+\ of\ body\ 2\ at\ \(.*\)\ m\ on\ level\ 1\ left\ the\ grid\ through\ its\ side\ y\+ ]] ||
      fail "the sentence on $n ranks: $sentence"
   echo "   on $n: $sentence"
   printf '%s\n' "${sentence% stands in *}" >sentence_$n # the directory differs
   if ls -A ranks_$n | grep '\.part'; then fail "a partial file was left on $n ranks"; fi
done
cmp sentence_1 sentence_2 && cmp sentence_1 sentence_4 || fail 'the ranks name different particles'
"$PYTHON" - <<'END'
from runs import *

for ranks in (1, 2, 4):
    run = f"ranks_{ranks}"
    history = energy(run)
    probe = History(Path(run) / "probe_stays.dat")
    require(f"{run}: rows of the probe", probe.rows == history.rows)
    require(f"{run}: the probe is finite", all(np.all(np.isfinite(values)) for values in probe.columns.values()))
    # 0.2 m at 5 m/s, and half a particle more: the last row stands within a row before the step that left
    check(f"{run}: time of the last row off that of the way of the outermost centres, in rows",
          (history["time"][-1] - 0.225 / 5) / 0.001, 2.5)
    for one in snapshots(run):
        require(f"{run}: particles of a snapshot", len(one.ids) == 512 + 384)
        require(f"{run}: a snapshot is finite", all(np.all(np.isfinite(values)) for values in one.fields.values()))
finish()
END
