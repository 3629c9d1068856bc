#!/bin/bash
#test: beside
#test: limit 120
# The Python package as a user has it (package.py): a scene read, changed, run; its histories and snapshots; many runs at once; what
# fails, in the program's words; the command gimp3d-post.
. "$(dirname "$0")/../harness/env.sh"
cp "$ROOT/test/report/readers.nml" .
"$PYTHON" "$ROOT/test/report/package.py"
"$PYTHON" -m gimp3d completion | bash -n || fail 'the completion of bash'
status=0
"$PYTHON" -m gimp3d nonsense 2>said.log || status=$?
[ $status -eq 2 ] && grep -q "no command 'nonsense'; the commands are plots" said.log || fail 'an unknown command'
for name in plots report hardness error_bar study solve identify movie closeup tool_surface pole_figure gallery benchmarks surfaces heights; do
   "$PYTHON" -m gimp3d $name --help | grep -q "^usage: gimp3d-post $name" || fail "gimp3d-post $name --help"
done
[ "$("$PYTHON" -m gimp3d surfaces --help | grep -cE '^ +[a-z0-9. -]+ (sphere|cone|die) OUT( --[a-z-]+ [A-Z]+)+$')" -eq 3 ] ||
   fail 'gimp3d-post surfaces --help: one line each for sphere, cone and die'

# what a command cannot do is one sentence: no run, and nothing is written
refused() { # refused WORDS COMMAND...
   status=0
   "$PYTHON" -m gimp3d "${@:2}" >said.log 2>&1 || status=$?
   [ $status -eq 2 ] && [ "$(wc -l <said.log)" -eq 1 ] && grep -q -- "$1" said.log || { cat said.log; fail "${*:2}"; }
}
# a reader that has closed the console does not cost files
{ "$PYTHON" -m gimp3d hardness --no-plots read; echo $? >status; } 2>said.log | true
[ "$(cat status)" -eq 0 ] && [ ! -s said.log ] && [ -s read/hardness_profile.csv ] || { cat said.log; fail 'hardness | true'; }
mkdir flat
printf "&grid geometry='plane_strain', lower=0,0,0, upper=1,1,1, cell_size=1 /\n&tool name='t' /\n" >flat/case.nml
refused 'plane strain' hardness flat
refused 'given by its section' closeup flat
printf '&grid lower=0,0,0, upper=1,1,1, cell_size=1 /\n&quasi_static step=1 /\n' >slow.nml
refused 'quasi-static' solve slow.nml --error 1 --budget 1
[ "$(ls flat)" = case.nml ] || fail 'a refused command wrote files'
