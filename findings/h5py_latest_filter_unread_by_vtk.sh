#!/bin/sh
# h5py 3.16.0 (HDF5 2.0.0) and VTK 9.7.2: a compressed dataset written with libver='latest' cannot be read by VTK.
#
# Who is bitten: who writes VTKHDF files or height maps with libver='latest' (needed for SWMR, advised for speed) and
#       compresses them. The newest VTK, h5py of HDF5 1.12 and programs of Debian's HDF5 1.10 all refuse the dataset.
# A good guess: a gzip dataset is readable by any HDF5 of the last ten years; a change of format shows without a
#       filter too.
# Seen: without a filter the file is read; with gzip "bad version number for layout message"; with gzip and
#       libver=('v110', 'v114') it is read.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check h5py==3.16.0 vtk==9.7.2 numpy==2.4.6
cat >"$dir/try.py" <<'END'
import sys

import h5py
import numpy as np
import vtk

print("h5py", h5py.__version__, "HDF5", h5py.version.hdf5_version, "VTK", vtk.vtkVersion.GetVTKVersion())
vtk.vtkObject.GlobalWarningDisplayOff()


def points_read(libver, **how):
    """Points that VTK reads of a cloud of 1000 points written so."""
    with h5py.File("cloud.hdf", "w", libver=libver) as file:
        group = file.create_group("VTKHDF")
        group.attrs["Version"] = (1, 0)
        group.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        for name, count in (("Points", 1000), ("Cells", 0), ("ConnectivityIds", 0)):
            group["NumberOf" + name] = np.array([count])
        group.create_dataset("Points", data=np.random.default_rng(1).random((1000, 3)), **how)
        for name, values in (("Connectivity", np.zeros(0, "i8")), ("Offsets", np.zeros(1, "i8"))):
            group[name] = values
        group["Types"] = np.zeros(0, "u1")
    reader = vtk.vtkHDFReader()
    reader.SetFileName("cloud.hdf")
    reader.Update()
    return reader.GetOutput().GetNumberOfPoints()


cases = [(None, "gzip", 1000), ("latest", None, 1000), ("latest", "gzip", 0), (("v110", "v114"), "gzip", 1000)]
same = True
for libver, filter_, expected in cases:
    found = points_read(libver, **({"compression": filter_} if filter_ else {}))
    print(f"libver={libver}, compression={filter_}: VTK reads {found} of 1000 points")
    same = same and found == expected
sys.exit(0 if same else "these versions do otherwise")
END
cd "$dir" && venv/bin/python try.py 2>errors.log || { tail -n 3 errors.log; exit 1; }
