#!/bin/sh
#test: beside
# Twenty valid scenes made by chance; the two hundred are in random_scenes_long.sh.
#test: limit 180
#test: long
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" "$ROOT/test/stability/random_scenes.py" "$WORK/scenes" "$GIMP3D" 20 --ranks 1 2 1 1 || fail 'see above'
# The judge can fail: a program that ends well and writes nothing, one that ends with a status of its own, one that does not end.
for wrong in 'exit 0' 'exit 1' 'echo "gimp3d: a" >&2; echo "gimp3d: b" >&2; exit 3'; do
   printf '#!/bin/sh\n%s\n' "$wrong" >wrong && chmod +x wrong
   "$PYTHON" "$ROOT/test/stability/random_scenes.py" "$WORK/wrong_scenes" "$WORK/wrong" 1 --ranks 1 >wrong.log &&
      fail "a program that does '$wrong' was taken for good"
done
exit 0
