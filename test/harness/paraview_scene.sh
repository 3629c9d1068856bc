#!/bin/bash
#test: long
#test: limit 600
# The scene of post/gimp3d/paraview_scene.py for runs with all shapes of tools, levels, and each kind of particle domains: every surface
# where formulas have it, at each snapshot; the pictures; a state that shows the same when it is loaded. Needs ParaView.
. "$(dirname "$0")/../harness/env.sh"

if ! command -v pvpython >/dev/null; then
   echo 'left out: ParaView is not there (apt-get install paraview)'
   exit 0
fi
check() { pvpython "$ROOT/test/harness/paraview_scene.py" "$@" >check.log 2>&1; }
scene() { pvpython "$ROOT/post/gimp3d/paraview_scene.py" "$@" >scene.log 2>&1; }
refused() { # refused WORDS ARGUMENT...: status 2 and one sentence
   local words=$1 status=0
   shift
   scene "$@" || status=$?
   [ $status -eq 2 ] && [ "$(wc -l <scene.log)" -eq 1 ] && grep -q "$words" scene.log ||
      { cat scene.log; fail "status $status where it should say: $words"; }
}

a_run() { # a_run NAME DOMAIN TOOLS: of the scene, with the tools of these names
   sed \
      "s/domain='corners'/domain='$2'/; s/'scene'/'$1'/; /^&tool/{/name='\($3\)'/!d}" \
      "$ROOT/test/harness/paraview_scene.nml" >scene.nml
   run_scene 1 scene.nml || { cat run_1.log; fail "the run $1"; }
}
a_run corners corners '.*'
a_run stretch stretch none
a_run fixed fixed none
# with planted failures: a tool that stands still at the end, one without its history, a particle of another size
a_run planted corners 'flat\|wedge'
sed -i '$d' planted/tool_flat.dat
rm planted/tool_wedge.dat
"$PYTHON" -c '
import glob, h5py
with h5py.File(max(glob.glob("planted/*.hdf")), "r+") as file:
    file["VTKHDF/PointData/domain"][17, 4] *= 1.1'
check corners stretch fixed planted || true
for words in 'FAILED: flat at 0.02 s: its tip: off by 0.05' 'FAILED: flat at 0.02 s: off' \
   'FAILED: volumes at 0.02 s' 'the tool wedge is not drawn: there is no tool_wedge.dat'; do
   grep -q "$words" check.log || { cat check.log; fail "not noticed: $words"; }
done
[ "$(tail -n 1 check.log)" = '3 wrong' ] || { cat check.log; fail 'the scenes'; }

sed 's/^&output .*/\&output directory='\''rings'\'', every=20e-6 \//' "$ROOT/input/axisymmetric_taylor.nml" >scene.nml
run_scene 1 scene.nml || { cat run_1.log; fail 'the run of a section'; }
check --rings rings || { cat check.log; fail 'vectors and tensors of a revolved section'; }

mkdir empty
cp corners/case.nml corners/particles.hdf.series empty
sed -i '/hdf",/d' empty/particles.hdf.series
refused 'no such directory' absent
refused 'not written a snapshot yet' empty
if ! python3 -c 'import paraview' 2>/dev/null; then
   status=0
   python3 -m gimp3d.paraview_scene corners >scene.log 2>&1 || status=$?
   [ $status -eq 2 ] && grep -q pvpython scene.log || fail 'another Python does not say what it lacks'
fi
if [ -z "${DISPLAY:-}" ]; then
   refused 'xvfb-run -a' corners
   scene --no-picture corners || { cat scene.log; fail 'the state without a picture'; }
   [ -s corners/paraview.pvsm ] && [ ! -e corners/paraview.png ] || fail 'the state alone is not what was asked for'
   if ! command -v Xvfb >/dev/null; then
      echo 'pictures left out: there is no display (apt-get install xvfb xauth)'
      exit 0
   fi
   mkfifo number # one display for all: it takes a free number, and says which
   Xvfb -displayfd 3 -screen 0 1280x1024x24 3>number >xvfb.log 2>&1 &
   trap "kill $!" EXIT
   read -r number <number
   export DISPLAY=:$number
fi

scene --frames corners || { cat scene.log; fail 'the pictures'; }
"$PYTHON" - corners/paraview.png corners/paraview_0*.png <<'END' || fail 'the pictures are not what they should be'
import sys
import matplotlib.image
last, *frames = [matplotlib.image.imread(path)[..., :3] for path in sys.argv[1:]]
assert len(frames) == 3 and last.shape == (900, 1200, 3), (len(frames), last.shape)
assert (frames[-1] == last).all() and all((frame != last).any(axis=2).mean() > 0.01 for frame in frames[:-1]), "frames"
colour = last.max(axis=2) - last.min(axis=2)
coloured, grey = (colour > 0.2).mean(), ((colour < 0.1) & (last.max(axis=2) < 0.9)).mean()
edges = (abs(last - [0.99, 1.0, 0.64]) < 0.02).all(axis=2).sum() # of the finer level
print(f"{coloured:.2f} of the picture is coloured, {grey:.2f} grey, {edges} pixels are on edges of the level")
assert coloured > 0.05 and grey > 0.05 and edges > 500
END
check --load "$PWD/corners/paraview.pvsm" "$PWD/loaded.png" || { cat check.log; fail 'the state cannot be loaded'; }
"$PYTHON" -c '
import sys, matplotlib.image
one, two = (matplotlib.image.imread(path)[..., :3] for path in sys.argv[1:])
off = (abs(one - two) > 0.1).any(axis=2).mean()
sys.exit(f"{off:.1%} of the pixels differ" if off > 1e-4 else 0)' corners/paraview.png loaded.png ||
   fail 'the state shows another picture'
