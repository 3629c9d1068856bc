#!/bin/bash
#test: beside
#test: limit 120
# The commands of the tutorials, as the documents have them: their files, names and options are there, and every scene takes its first
# step; scene 1 runs on coarser cells. What is planted in copies of the documents must be noticed. tutorial_long.sh runs all of it.
. "$(dirname "$0")/../harness/env.sh"
tutorial() { "$PYTHON" "$ROOT/test/indentation/tutorial.py" "$@"; }
for part in Makefile mk post input src test tools doc; do ln -s "$ROOT/$part" "$part"; done
ln -s "$GIMP3D" gimp3d

for document in tutorial tutorial_impact; do
   tutorial check "$ROOT" "$ROOT/doc/user/$document.md" || fail "$document.md"
done
for scene in input/tutorial/*.nml; do
   tutorial list doc/user/tutorial.md >commands && tutorial list doc/user/tutorial_impact.md >>commands
   grep -q "< $scene" commands || fail "$scene is in no tutorial"
done

# planted, in the first tutorial: no run is made to find them
planted() { # planted WORDS SED: with this change the check must fail, and say these words
   sed -e "$2" "$ROOT/doc/user/tutorial.md" >planted.md
   if cmp -s planted.md "$ROOT/doc/user/tutorial.md"; then fail "nothing was planted: $2"; fi
   if tutorial check "$ROOT" planted.md >planted.log; then fail "not noticed: $2"; fi
   grep -q -- "$1" planted.log || { cat planted.log; fail "noticed, but not told: $1"; }
   echo "ok      noticed: $1"
}
mkdir quick && cd quick && for part in Makefile mk post input; do ln -s "$ROOT/$part" "$part"; done
printf '#!/bin/sh\necho "particles on 1 rank"\n' >gimp3d && chmod +x gimp3d # what is planted needs no run of the right scenes
planted 'there is no target hardnes:' 's/^make hardness RUN=out.tutorial.cone$/make hardnes RUN=out\/tutorial\/cone/'
planted 'the Makefile has no RUM:' 's/^make plots RUN=/make plots RUM=/'
planted 'no script has the option --repeat:' 's/--repeats 1/--repeat 1/'
planted 'no command before makes out/tutorial/sheres:' 's,^make report RUN=out/tutorial/sphere,make report RUN=out/tutorial/sheres,'
planted 'the scene is not there:' 's,< input/tutorial/film.nml,< input/tutorial/flim.nml,'
planted 'what is more than a scene here:' 's,^./gimp3d < input/tutorial/film.nml,./gimp3d --fast < input/tutorial/film.nml,'
planted 'a `sed` has changed nothing' 's/cell_size=2.56e-6.cell_size=3.2e-6/cell_size=2.55e-6\/cell_size=3.2e-6/'
cd ..

# what `run` compares
check_run() { # check_run STATUS PRINTED EXPECTED
   { echo '```sh'; echo "printf '$2'"; echo '```'; echo; echo '```text'; printf "$3"; echo '```'; } >small.md
   status=0
   tutorial run small.md >small.log || status=1
   [ "$status" = "$1" ] || { cat small.md small.log; fail "status $status in place of $1"; }
}
check_run 0 'E 70.1 GPa +- 0.8 1.2 %%\n' 'E 70.3 GPa +- 0.3 0.4 %%\n'
check_run 1 'E 70.1 GPa +- 0.8 1.2 %%\n' 'E 75.3 GPa +- 0.8 1.2 %%\n'
check_run 1 'E 70.1 GPa +- 0.8 1.2 %%\n' 'E 70.1 MPa +- 0.8 1.2 %%\n'
check_run 0 'a\nb\n180 steps in 25 s\nc\n' 'a\n...\n181 steps in 3 s\n...\n'
check_run 1 'a\nb\n180 steps in 25 s\nc\n' 'a\n181 steps in 3 s\n...\n'
check_run 1 'a\nb\nc\n' 'a\n...\nc\nb\n'
check_run 1 'a\n' 'a\nb\n'
printf '```sh\ntrue\nfalse\n```\n' >small.md
if tutorial run small.md >small.log; then fail 'a command that fails is not noticed'; fi

# scene 1 on coarser cells: what the tutorial says of it holds there too
sed -e 's/cell_size=2.56e-6/cell_size=3.2e-6/' "$ROOT/input/tutorial/sphere.nml" >coarse.nml
run_scene 1 coarse.nml || { tail -n 5 run_1.log; fail 'scene 1'; }
"$PYTHON" -m gimp3d hardness --no-plots out/tutorial/sphere >table || { cat table; fail 'hardness of scene 1'; }
grep -E 'E, true|kinetic energy' table
"$PYTHON" - <<'END' || fail 'scene 1 on coarser cells'
import json
found = json.load(open("out/tutorial/sphere/hardness.json"))
print(f"   E of the unloading {found['young_true'] / 1e9:.4g} GPa, load {1e3 * found['max_load']:.4g} mN, Hertz 13.13 mN")
assert abs(found["young_true"] / 70e9 - 1) < 0.05
assert abs(found["max_load"] / 13.13e-3 - 1) < 0.04
assert 0.01 < found["kinetic_share"] < 0.1
END
