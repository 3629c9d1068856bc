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
