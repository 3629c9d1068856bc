#!/bin/sh
# METIS 5.1 (pymetis 2025.2.2): METIS_PartGraphKway leaves parts empty where a balanced partition is there.
#
# Who is bitten: parallel codes with few, large pieces to share (blocks of cells, grains, patches of a nested level): a rank
#       without work, and an empty array where the first element is asked for.
# A good guess: the imbalance it allows (3 %) is held, or the call fails; an unweighted chain of 8 vertices over 5 ranks
#       gives each rank one or two.
# Seen: it returns normally with parts of 0, 3, 0, 3, 2 vertices; 8 over 8 leaves four parts empty, where one vertex a part is
#       the only balanced answer. METIS_PartGraphRecursive fills each part in these cases.
# Instead: count the parts' members, and take the recursive method where vertices are few for the parts (or both, and the
#       better one).
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pymetis==2025.2.2 numpy==2.3.5
cat >"$dir/chain.py" <<'END'
import sys

import numpy
import pymetis

chain = [[j for j in (i - 1, i + 1) if 0 <= j < 8] for i in range(8)]
seen = True
for parts in (5, 8):
    for recursive in (False, True):
        _, part = pymetis.part_graph(parts, adjacency=chain, recursive=recursive)
        members = numpy.bincount(part, minlength=parts)
        name = "recursive" if recursive else "kway"
        print(f"8 vertices in a chain, {parts} parts, {name}:", *members)
        seen = seen and (members.min() > 0) == recursive
sys.exit(0 if seen else "this version does otherwise")
END
"$dir/venv/bin/python" "$dir/chain.py"
