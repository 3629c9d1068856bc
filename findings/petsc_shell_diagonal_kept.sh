#!/bin/sh
# PETSc 3.18.5 (Debian 12): with a shell matrix, Jacobi keeps the diagonal of the first solve, KSPSetOperators or not.
#
# Who is bitten: matrix-free Newton and time stepping codes (MATSHELL, or petsc4py's Python matrices) whose tangent changes
#       between solves: each later solve is preconditioned by the first one's diagonal. Solutions are right, products are
#       many times as many.
# A good guess: KSPSetOperators before each solve (or KSPSetUp) makes the preconditioner anew, as with matrices whose values
#       were set.
# Seen: the matrix's own diagonal as preconditioner takes 1 product. After its values change: 280 products, and the
#       routine for the diagonal is not asked again, after KSPSetOperators and KSPSetUp neither: the object's state did not
#       change. MatAssemblyBegin and MatAssemblyEnd on the shell matrix count as a change: 1 product.
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=python3-petsc4py-real3.18 bookworm "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/solve.py" <<'END'
import sys

import numpy
from petsc4py import PETSc

print("PETSc", ".".join(str(number) for number in PETSc.Sys.getVersion()))
if PETSc.Sys.getVersion() != (3, 18, 5):
    sys.exit("pinned to 3.18.5, and Debian 12 has another now")


class Diagonal:
    def __init__(self, values):
        self.values, self.asked = values, 0

    def mult(self, matrix, x, y):
        y.setArray(self.values * x.getArray())

    def getDiagonal(self, matrix, diagonal):
        self.asked += 1
        diagonal.setArray(self.values)


def solved(what):
    x.set(0.0)
    ksp.solve(b, x)
    exact = abs(x.getArray() * operator.values - 1.0).max() < 1e-5
    print(f"{what}: {ksp.getIterationNumber()} products, diagonal asked for {operator.asked} times, exact: {exact}")
    return ksp.getIterationNumber(), operator.asked


operator = Diagonal(numpy.ones(2000))
matrix = PETSc.Mat().createPython([2000, 2000], operator)
matrix.setUp()
ksp = PETSc.KSP().create()
ksp.setOperators(matrix)
ksp.setType("cg")
ksp.getPC().setType("jacobi")
ksp.setTolerances(rtol=1e-8)
x, b = matrix.createVecs()
b.set(1.0)
first = solved("first solve")
operator.values = numpy.linspace(1.0, 1e4, 2000)
changed = solved("values changed")
ksp.setOperators(matrix, matrix)
ksp.setUp()
again = solved("KSPSetOperators and KSPSetUp")
matrix.assemble()
assembled = solved("assembled")
seen = first == (1, 1) and min(changed[0], again[0]) > 100 and again[1] == 1 and assembled == (1, 2)
sys.exit(0 if seen else "this version does otherwise")
END
chroot "$dir/root" env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
   PYTHONPATH=/usr/lib/petscdir/petsc3.18/x86_64-linux-gnu-real/lib/python3/dist-packages \
   python3 /tmp/solve.py 2>"$dir/errors" || { tail -n 3 "$dir/errors"; exit 1; }
