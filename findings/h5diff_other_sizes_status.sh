#!/bin/sh
# HDF5 1.10.8 (Debian 12): h5diff ends with status 0 when a dataset has another size, shape or kind of numbers
# in the two files.
#
# Who is bitten: regression tests of simulation codes that compare results by h5diff and go by its status: a
#       run that lost particles, or wrote integers in place of reals, passes.
# A good guess: 0 is "no differences found", 1 "some", 2 an error, so that files with 5 and with 6 particles
#       are not 0. A missing dataset gives 1, one other value gives 1.
# Seen: 5 values and 6, 5 and 5 x 1, doubles and integers of the same values, doubles and integers of other
#       values: "Some objects are not comparable" on standard output, and status 0, with -p and -d too. With
#       -q, as tests have it, not a word. Another dataset of the same file that differs gives 1, so the status
#       hangs on what else is there.
# Instead: h5diff -c lists what it did not compare: take any line of its output for a difference, as well as a
#       status above 0; or compare in Python with shapes and types.
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' \
   'Component: main' | head -n 1)
debootstrap --variant=minbase --include=hdf5-tools,python3-h5py \
   bookworm "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/compare.py" <<'END'
import subprocess
import sys

import h5py
import numpy

x = numpy.arange(5.0)
files = {
    "reference": x,
    "same": x,
    "one other value": x + [0, 0, 0, 0, 1],
    "six values": numpy.arange(6.0),
    "5 x 1": x.reshape(5, 1),
    "integers": x.astype(int),
    "other integers": x.astype(int) + 7,
}
for name, values in files.items():
    with h5py.File(name + ".h5", "w") as file:
        file["x"] = values
with h5py.File("missing.h5", "w") as file:
    file["y"] = x
print(subprocess.run(["h5diff", "-V"], capture_output=True, text=True).stdout.strip())
status, silent = {}, {}
for name in (*files, "missing"):
    runs = [
        subprocess.run(["h5diff", *option, "reference.h5", name + ".h5"], capture_output=True, text=True)
        for option in ([], ["-q"], ["-p", "1e-6"], ["-d", "1e-6"], ["-c"])
    ]
    status[name] = [run.returncode for run in runs]
    silent[name] = runs[1].stdout + runs[1].stderr == ""
    print(f"{name}: status {status[name][0]}, with -q, -p, -d, -c", *status[name][1:], end="; ")
    print("output with -q:", repr(runs[1].stdout + runs[1].stderr), "with -c:", repr(runs[4].stdout[:80]))
passed = ("same", "six values", "5 x 1", "integers", "other integers")
seen = all(status[name][:4] == [0, 0, 0, 0] and silent[name] for name in passed)
failed = all(status[name][:4] == [1, 1, 1, 1] for name in ("one other value", "missing"))
sys.exit(0 if seen and failed else "this version does otherwise")
END
chroot "$dir/root" sh -c 'cd /tmp && python3 compare.py'
