#!/bin/sh
# f90nml 1.5: patch() loses values without a word when an array changes its length or is written with a repeat count.
#
# Who is bitten: scripts that vary a namelist case of a simulation code (parameter studies).
# A good guess: f90nml.patch(file, {...}, new) gives a file that reads back as the changed namelist.
# Seen: 1. an array of two patched by three values keeps two of them; the third is gone, no warning.
#       2. `3*1.0` patched by three values becomes `5.0*1.0`: the count is taken for the first value, the other two
#          are gone, and a repeat count that is no whole number is not valid in a namelist.
#       3. of two groups of one name only the first is patched.
# Instead: f90nml.read, change, write; that form keeps all three (checked below).
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check f90nml==1.5
cat >"$dir/try.py" <<'END'
import io
import sys
import warnings

import f90nml

warnings.simplefilter("error")  # a warning would be a word
print("f90nml", f90nml.__version__)


def patched(text, change):
    with open("case.nml", "w") as file:
        file.write(text)
    f90nml.patch("case.nml", change, "new.nml")
    with open("new.nml") as file:
        return file.read()


def rewritten(text, change):
    namelist = f90nml.reads(text)
    for group, values in change.items():
        for one in namelist[group] if isinstance(namelist[group], list) else [namelist[group]]:
            one.update(values)
    out = io.StringIO()
    namelist.write(out)
    return f90nml.reads(out.getvalue())


seen = [
    ("longer array", "&a x=1, 2 /\n", {"a": {"x": [5, 6, 7]}}, "&a x=5, 6 /\n"),
    ("repeat count", "&a x=3*1.0 /\n", {"a": {"x": [5.0, 6.0, 7.0]}}, "&a x=5.0*1.0 /\n"),
    ("two groups", "&a x=1 /\n&a x=2 /\n", {"a": {"x": 9}}, "&a x=9 /\n&a x=2 /\n"),
]
same = True
for name, text, change, expected in seen:
    found = patched(text, change)
    print(f"{name}: {text.split()} patched by {change} -> {found.split()}")
    same = same and found == expected
same = same and rewritten("&a x=1, 2 /", {"a": {"x": [5, 6, 7]}})["a"]["x"] == [5, 6, 7]
same = same and rewritten("&a x=3*1.0 /", {"a": {"x": [5.0, 6.0, 7.0]}})["a"]["x"] == [5.0, 6.0, 7.0]
same = same and [one["x"] for one in rewritten("&a x=1 /\n&a x=2 /", {"a": {"x": 9}})["a"]] == [9, 9]
sys.exit(0 if same else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
