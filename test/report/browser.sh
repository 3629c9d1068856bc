#!/bin/bash
#test: beside
#test: long
#test: limit 600
# Reports and the gallery, opened in headless Chromium at 400 and 1600 pixels: every picture is shown, no script fails, nothing is
# fetched, nothing scrolls sideways, curves can be read, zoomed and hidden. What is planted must be noticed.
. "$(dirname "$0")/../harness/env.sh"
here=$ROOT/test/report
chromium=
for name in chromium chromium-browser google-chrome google-chrome-stable; do
   [ "$chromium" ] || chromium=$(command -v $name || :)
done
[ "$chromium" ] || { echo 'left out: Chromium is not there (apt-get install chromium)'; exit 0; }

# The gallery of two scenes, of which one ends with a fault; its reports are looked at too
mkdir scenes
cp "$here/hostile.nml" scenes/hostile.nml
sed "s:'out':'fault':" "$ROOT/test/regression/leaving.nml" >scenes/leaving.nml
status=0
"$PYTHON" -m gimp3d gallery --scenes scenes --output gallery --program "$GIMP3D" >gallery.log 2>&1 || status=$?
[ $status -eq 1 ] || { cat gallery.log; fail "status $status of a gallery with a scene that fails"; }
"$PYTHON" "$here/opened.py" "$chromium"
