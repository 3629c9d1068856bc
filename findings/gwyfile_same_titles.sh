#!/bin/sh
# gwyfile 0.3.0 (PyPI): of channels with the same title get_datafields returns one; the others are lost without a word.
#
# Who is bitten: who reads height maps of an imprint or a tip from Gwyddion's files: instruments write the ways there and back
#       (trace and retrace) as two channels "Height", and a levelled copy in Gwyddion keeps its title.
# A good guess: the call returns as many fields as the file has channels, and titles serve to tell them apart.
# Seen: a file with "Height" (mean 1 nm), "Phase", "Height" (mean 3 nm): get_datafields gives two fields, of "Height" that with
#       3 nm. The file itself holds all three (keys /0/data, /1/data, /2/data of the container).
# Instead: walk the container's keys /N/data and take their titles from /N/data/title.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check gwyfile==0.3.0 numpy==2.3.5
cat >"$dir/channels.py" <<'END'
import sys

import gwyfile
import numpy
from gwyfile.objects import GwyContainer, GwyDataField

path = sys.argv[1]
written = GwyContainer()
for number, (title, mean) in enumerate((("Height", 1e-9), ("Phase", 0.0), ("Height", 3e-9))):
    written[f"/{number}/data/title"] = title
    written[f"/{number}/data"] = GwyDataField(numpy.full((4, 4), mean), xreal=1e-6, yreal=1e-6)
written.tofile(path)

read = gwyfile.load(path)
fields = gwyfile.util.get_datafields(read)
held = sorted(key for key in read if key.endswith("/data"))
print("in the file:", ", ".join(f"{key} {read[key + '/title']} {read[key].data.mean():g} m" for key in held))
print("get_datafields:", ", ".join(f"{title} {field.data.mean():g} m" for title, field in sorted(fields.items())))
seen = len(held) == 3 and sorted(fields) == ["Height", "Phase"] and abs(fields["Height"].data.mean() - 3e-9) < 1e-15
sys.exit(0 if seen else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/channels.py" "$dir/scan.gwy"
