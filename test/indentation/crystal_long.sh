#!/bin/bash
#test: long
#test: beside
#test: limit 3600
# input/crystal.nml, to a depth of three cells, on the faces (001), (011) and (111): the pile-up has four, two and three places (crystal.py). The crystal is
# turned by 20 degrees about the tool's axis, so that its planes are not the grid's.
. "$(dirname "$0")/../harness/env.sh"
for face in "001 20,0,0" "011 20,45,0" "111 20,54.7356103172453,45"; do
   set -- $face
   sed "s/orientation=0,0,0/orientation=$2/; s:'out/crystal':'$1':" "$ROOT/input/crystal.nml" >scene.nml
   run_scene 2 scene.nml "$1.log" || { tail -n 5 "$1.log"; fail "the face ($1)"; }
done
exec "$PYTHON" "$ROOT/test/indentation/crystal.py"
