#!/bin/sh
# Load, unload, leave: on 1, 2 and 4 ranks the same load (in the whole model the contact lies across the ranks), nothing left
# when the tool has gone; four quarters make a whole.
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
scene=$ROOT/test/contact/in_and_out.nml
for n in 1 2 4; do
   sed "s#DIRECTORY#run_$n#" "$scene" >"scene_$n.nml"
   run_scene "$n" "scene_$n.nml" || fail "ended with status $? on $n ranks: $(tail -n 3 "run_$n.log")"
done
"$PYTHON" "$ROOT/test/contact/contact.py" in_and_out run_1 run_2 run_4 || fail 'see above'
sed -e 's#DIRECTORY#whole#' -e 's/lower=0,0,0, upper=18e-6,18e-6,14e-6/lower=-18e-6,-18e-6,0, upper=18e-6,18e-6,14e-6/' \
    -e "s/'symmetry'/'free'/g" -e 's/lower=0,0,0, upper=16e-6,16e-6,10e-6/lower=-16e-6,-16e-6,0, upper=16e-6,16e-6,10e-6/' \
    "$scene" >whole.nml
for n in 1 4; do
   sed "s#'whole'#'whole_$n'#" whole.nml >"whole_$n.nml"
   run_scene "$n" "whole_$n.nml" "whole_$n.log" || fail "the whole ended with status $? on $n ranks"
done
"$PYTHON" "$ROOT/test/contact/contact.py" in_and_out whole_1 whole_4 || fail 'see above'
"$PYTHON" "$ROOT/test/contact/contact.py" whole run_1 whole_4 || fail 'see above'
# the check can fail: a history with one load changed by a millionth
mkdir wrong && cp run_1/tool_ball.dat wrong/
"$PYTHON" - <<'P'
lines = open('wrong/tool_ball.dat').read().splitlines()
rows = [i for i, line in enumerate(lines) if not line[:1].isalpha()]
at = max(rows, key=lambda i: float(lines[i].split()[4]))
words = lines[at].split()
words[4] = repr(float(words[4])*(1 + 1e-6))
lines[at] = '  ' + ' '.join(words)
open('wrong/tool_ball.dat', 'w').write('\n'.join(lines) + '\n')
P
if "$PYTHON" "$ROOT/test/contact/contact.py" in_and_out run_1 wrong >wrong.log; then fail 'a planted difference was not seen'; fi
