#!/bin/sh
# meshio 5.3.5: read() of an XDMF time series ends the caller's program instead of raising an error.
#
# Who is bitten: scripts and notebooks that try a file and go on with the next (`except Exception` does not catch it).
# A good guess: a ReadError, as for other files that a reader cannot take.
# Seen: a series that meshio's own TimeSeriesWriter has written makes meshio.read raise SystemExit(1); its
#       TimeSeriesReader reads both times.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check meshio==5.3.5 h5py==3.16.0 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import meshio
import numpy as np

print("meshio", meshio.__version__)
points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
with meshio.xdmf.TimeSeriesWriter("series.xdmf") as writer:
    writer.write_points_cells(points, [("tetra", np.array([[0, 1, 2, 3]]))])
    for time in 0.0, 1.0:
        writer.write_data(time, point_data={"u": np.full(4, time)})
try:
    meshio.read("series.xdmf")
    caught = "nothing"
except Exception as error:
    caught = type(error).__name__
except SystemExit as end:
    caught = f"SystemExit({end.code})"
with meshio.xdmf.TimeSeriesReader("series.xdmf") as reader:
    reader.read_points_cells()
    steps, last = reader.num_steps, reader.read_data(1)[1]["u"]
print(f"meshio.read raises {caught}; TimeSeriesReader: {steps} times, u at the second {last}")
sys.exit(0 if (caught, steps) == ("SystemExit(1)", 2) and (last == 1).all() else "this version does otherwise")
END
cd "$dir" && venv/bin/python try.py
