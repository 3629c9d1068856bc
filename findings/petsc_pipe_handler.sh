#!/bin/sh
# PETSc 3.18.5 (Debian 12): PetscInitialize takes SIGPIPE from a program that ignores it, PetscFinalize leaves the default.
#
# Who is bitten: programs that ignore SIGPIPE so that a run outlives its console (`run | head`, a closed session), and every
#       Python program: Python ignores the signal, and raises BrokenPipeError where a pipe has no reader.
# A good guess: a library leaves the application's choice as it is, or puts it back when it is finalised.
# Seen: ignored before; PETSc's handler after PetscInitialize, so that a closed console ends the run with PETSc's message and
#       MPI_ABORT; the system's default after PetscFinalize, so that the last line of output ends the program by the signal.
# Instead: ignore SIGPIPE again after each of the two calls.
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=python3-petsc4py-real3.18 bookworm "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
mount -t proc proc "$dir/root/proc"
trap 'umount "$dir/root/proc"; rm -rf "$dir"' EXIT
cat >"$dir/root/tmp/pipe.py" <<'END'
import signal
import sys


def disposition():
    """What the kernel knows of SIGPIPE."""
    bit = 1 << (signal.SIGPIPE - 1)
    sets = dict(line.split(":") for line in open("/proc/self/status") if line.startswith("Sig"))
    return "ignored" if int(sets["SigIgn"], 16) & bit else "handled" if int(sets["SigCgt"], 16) & bit else "default"


seen = [disposition()]
import petsc4py

petsc4py.init([])
from petsc4py import PETSc

print("PETSc", ".".join(str(number) for number in PETSc.Sys.getVersion()))
if PETSc.Sys.getVersion() != (3, 18, 5):
    sys.exit("pinned to 3.18.5, and Debian 12 has another now")
seen.append(disposition())
PETSc._finalize()
seen.append(disposition())
signal.signal(signal.SIGPIPE, signal.SIG_IGN)
seen.append(disposition())
print("before, initialised, finalised, ignored again:", ", ".join(seen))
sys.exit(0 if seen == ["ignored", "handled", "default", "ignored"] else "this version does otherwise")
END
chroot "$dir/root" env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
   PYTHONPATH=/usr/lib/petscdir/petsc3.18/x86_64-linux-gnu-real/lib/python3/dist-packages \
   python3 /tmp/pipe.py 2>"$dir/errors" || { tail -n 3 "$dir/errors"; exit 1; }
