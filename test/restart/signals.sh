#!/bin/bash
#test: beside
#test: limit 120
# SIGUSR1 makes a checkpoint and the run goes on; SIGTERM, SIGINT and the wall limit make one and end the run with status 5; what goes
# on from it ends with the same bits. Also on 2 ranks, where one rank alone gets the signal, and where mpirun gets it.
. "$(dirname "$0")/../harness/env.sh"
exec "$PYTHON" "$ROOT/test/restart/signals.py"
