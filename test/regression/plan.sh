#!/bin/sh
# mode='plan': writes nothing, exits 0, and says what the run then has (plan.py): a scene with a tool, one with levels, one without
# either, and one that moves at once. A plan of bad input, and one of a run that goes on, are refused; a scene that fails has none.
#test: beside
#test: limit 200
. "$(dirname "$0")/../harness/env.sh"

planned() { # planned NAME SCENE RANKS [given step]: plan and run
   name=$1 scene=$2 ranks=$3
   shift 3
   mkdir -p "plan_$name"
   sed "s/&scene /\&scene mode='plan', /" "$scene" >"plan_$name.nml"
   (cd "plan_$name" && mpirun -n "$ranks" "$GIMP3D" --json "../plan_$name.json" "../plan_$name.nml" >"../plan_$name.log" 2>&1) || fail "plan of $name: status $?: $(tail -n 3 "plan_$name.log")"
   [ -z "$(ls -A "plan_$name")" ] || fail "the plan of $name wrote $(ls -A "plan_$name")"
   run_scene "$ranks" "$scene" "run_$name.log" || fail "$name: status $?"
   echo "ok      $name on $ranks"
   "$PYTHON" "$ROOT/test/regression/plan.py" "plan_$name.log" "plan_$name.json" "run_$name.log" out "$@" || fail "plan of $name"
   rm -rf out
}

sed "s:'out/cone':'out':; s/end_time=[0-9.e-]*/end_time=1e-10/; s/every=4e-10/every=4e-11/; s/speeds=0,150.8/speeds=150.8,150.8/" "$ROOT/input/cone.nml" >cone.nml
planned cone cone.nml 2 'given step'
sed "s:'out/two_spheres':'out':; s/,'tecplot'//" "$ROOT/input/two_spheres.nml" >spheres.nml
planned spheres spheres.nml 1
sed "s:'out/incline':'out':; s/end_time=0.3/end_time=0.03/" "$ROOT/input/incline.nml" >incline.nml
planned incline incline.nml 1
sed "s:'out/taylor':'out':; s/end_time=80e-6/end_time=4e-6/; s/every=20e-6/every=1e-6/" "$ROOT/input/taylor.nml" >taylor.nml
planned taylor taylor.nml 1 impact
planned levels "$ROOT/test/io/levels.nml" 2 flying

mpirun -n 1 "$GIMP3D" --plan --json same.json spheres.nml >same.log 2>&1 || fail "--plan: status $?"
[ ! -e out ] && grep -q '"kind": "explicit"' same.json || fail '--plan: wrote output, or no figures'
# the same with a run: the figures of its end, which its cost.dat has too
"$GIMP3D" --json run.json <spheres.nml >run.log 2>&1 || fail "a run with --json: status $?"
"$PYTHON" - <<'END' || fail 'the figures of a run'
import json
from gimp3d.run_log import log_of
figures, facts = json.load(open("run.json")), log_of("out").facts
assert figures["outcome"] == facts["outcome"] == "finished" and figures["outcome_text"].startswith("finished: "), figures
for name in ("steps", "particle_steps", "particles_at_start", "particle_steps_at_rest", "energy_balance_error_J", "simulated_s"):
    assert figures[name] == float(facts[name]), (name, figures[name], facts[name])
END
rm -r out
status=0
"$GIMP3D" --help >help.log || status=$?
[ $status -eq 0 ] && grep -q '^usage: gimp3d' help.log || fail "--help: $status"
[ "$("$GIMP3D" --version)" = "gimp3d $(sed -n "s/.*program_version = '\(.*\)'/\1/p" "$ROOT/src/base/constants.f90")" ] || fail --version
for words in --nothing '--restart' 'a.nml b.nml' '--restart out a.nml' nowhere.nml; do
   status=0
   # shellcheck disable=SC2086
   "$GIMP3D" $words >words.log 2>&1 || status=$?
   [ $status -eq 2 ] && [ "$(wc -l <words.log)" -eq 1 ] || fail "arguments $words: status $status, $(cat words.log)"
done

for change in '' 's/step=0.1/step=0.1, to=0.999/; s/end_time=[0-9]*/end_time=1/'; do # implicit steps; both kinds
   sed "s/&scene /\&scene mode='plan', /; $change" "$ROOT/input/hold.nml" >hold.nml
   run_scene 1 hold.nml hold.log || fail "plan of hold: status $?"
   cat hold.log >>holds.log
done
grep -q '^steps  *about 4[0-9] implicit;' holds.log || fail "plan of hold, which takes 47 steps: $(grep '^steps' holds.log)"
grep -q '^creep  *\(up to\|more than\) [0-9]* implicit steps' holds.log || fail "plan of hold: creep: $(cat holds.log)"
grep -q '^steps  *about [0-9]* implicit, [0-9]* explicit;' holds.log || fail "plan of both kinds of steps: $(grep '^steps' holds.log)"

sed "s/cell_size=[0-9.e-]*/cell_size=-1/" plan_cone.nml >bad.nml
status=0
"$GIMP3D" <bad.nml >bad.log 2>&1 || status=$?
[ $status -eq 2 ] || fail "a plan of bad input ended with status $status"
sed "s/mode='plan'/mode='plan', restart='out'/" plan_cone.nml >both.nml
status=0
"$GIMP3D" <both.nml >both.log 2>&1 || status=$?
[ $status -eq 2 ] && grep -q 'a plan needs a whole run' both.log || fail "plan and restart: status $status, $(cat both.log)"
sed "s/mode='plan'/mode='guess'/" plan_cone.nml >other.nml
status=0
"$GIMP3D" <other.nml >other.log 2>&1 || status=$?
[ $status -eq 2 ] && grep -q "mode='guess'" other.log || fail "another mode: status $status, $(cat other.log)"

sed "s/&scene /\&scene mode='plan', /" "$ROOT/test/regression/leaving.nml" >leaving.nml
for n in 1 2; do
   status=0
   run_scene $n leaving.nml leaving.log || status=$?
   [ $status -eq 3 ] && grep -q '^gimp3d: no plan can be made, because the first steps of the scene fail: .* left the grid' leaving.log ||
      fail "plan of a scene that fails, on $n: status $status, $(cat leaving.log)"
done
