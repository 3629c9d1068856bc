#!/bin/bash
#test: limit 120
# A full disk, a file that may not grow, a directory that goes away: the run ends with one sentence and status 4; the last whole
# checkpoint stays, and a run goes on from it.
. "$(dirname "$0")/../harness/env.sh"
set +e
failed=0
check() { # check SENTENCE CONDITION...
   local what=$1
   shift
   if "$@"; then echo "   $what"; else echo "FAILED: $what"; failed=1; fi
}
said() { grep -a '^gimp3d: cannot ' "$1"; }
once() { [ "$(grep -ac '^gimp3d: cannot ' "$1")" = 1 ]; }
whole() { # whole DIRECTORY: a run goes on from it
   "$GIMP3D" <<<"$(sed "s:&scene:\\&scene restart='$1',:; s:'OUT':'$1':; s:every_steps=10:wall_limit=0.01:" <<<"$scene")" >again.log 2>&1
   [ $? = 5 ] && grep -q '^goes on ' again.log
}
scene=$("$PYTHON" -c "
from restarts import *
print(scene(PLASTIC, 'OUT', 'every_steps=10', end=1000, every=0))")

# files that may not grow beyond 300 blocks of 1 kB: the checkpoint has 1.2 MB (Open MPI 5 has a file of its own for shared memory)
limited=${scene/every=0,/every=0, formats=\'none\',}
(ulimit -f 300; OMPI_MCA_btl=self "$GIMP3D" <<<"${limited//OUT/limited}" >limited.log 2>&1)
status=$?
check "a file that may not grow: status $status, $(said limited.log)" [ $status = 4 ]
check 'one sentence' once limited.log
check 'nothing begun is left' [ -z "$(ls limited | grep '^checkpoint.*part')" ]

# histories that may not grow beyond 16 kB, nothing else written: no torn file under its own name
histories=$(grep -v '^&checkpoint' <<<"${limited/end_time=1000/end_time=0.1}")
(ulimit -f 16; OMPI_MCA_btl=self "$GIMP3D" <<<"${histories//OUT/short}" >short.log 2>&1)
status=$?
check "histories that may not grow: status $status, $(said short.log)" [ $status = 4 ]
check 'one sentence' once short.log
torn() { for file in short/*.dat short/case.nml; do [ -e "$file" ] && [ -n "$(tail -c 1 "$file")" ] && echo "$file"; done; true; }
check "what is there under its own name is whole: $(ls short | grep -v 'part$' | tr '\n' ' ')" [ -z "$(torn)" ]
check "the history that lost a row ends with the one before: $(wc -l <short/energy.dat) lines" [ "$(wc -l <short/energy.dat)" -gt 5 ]
check 'nothing begun is left, and no lock' [ -z "$(ls short | grep -E 'part$|lock')" ]

# a small file system, where root may mount one
mkdir -p small
trap 'umount small 2>/dev/null' EXIT
if mount -t tmpfs -o size=4200k tmpfs small 2>/dev/null; then
   for ranks in 1 2; do
      rm -rf small/*
      mpirun -n $ranks "$GIMP3D" <<<"${scene//OUT/small/run}" >full.log 2>&1 &
      pid=$!
      for _ in $(seq 600); do
         [ "$(ls small/run 2>/dev/null | grep -c '^checkpoint_.*h5$')" = 2 ] && break
         sleep 0.02
      done
      head -c 4M /dev/zero >small/filler 2>/dev/null
      wait $pid
      status=$?
      check "a full disk on $ranks ranks: status $status, $(said full.log)" [ $status = 4 ]
      check 'one sentence' once full.log
      check 'nothing begun is left' [ -z "$(ls small/run | grep '^checkpoint.*part')" ]
      check "whole ones are left: $(ls small/run | grep '^checkpoint' | tr '\n' ' ')" [ "$(ls small/run | grep -c '^checkpoint')" -ge 1 ]
      rm -f small/filler
      cp -r small/run full_$ranks
      check 'and a run goes on from them' whole full_$ranks
   done
   umount small || sleep 1
else
   echo '   no file system can be mounted here: left out'
fi

# the directory goes away
"$GIMP3D" <<<"${scene//OUT/gone}" >gone.log 2>&1 &
pid=$!
for _ in $(seq 600); do
   [ -n "$(ls gone 2>/dev/null | grep '^checkpoint_.*h5$')" ] && break
   sleep 0.01
done
mv gone moved
wait $pid
status=$?
check "no directory: status $status, $(said gone.log)" [ $status = 4 ]
check 'one sentence' once gone.log
check 'and a run goes on where it is now' whole moved
exit $failed
