#!/bin/bash
#test: long
#test: limit 120
# What the machine and its batch system do to a run: the launcher of another MPI, limits of memory, file systems without locks. Each
# ends in one sentence, or does no harm.
. "$(dirname "$0")/../harness/env.sh"
set +e
failed=0
check() { # check SENTENCE CONDITION...
   local what=$1
   shift
   if "$@"; then echo "   $what"; else echo "FAILED: $what"; failed=1; fi
}
said() { grep -a '^gimp3d: ' "$1" | grep -v '^gimp3d: a block$'; }
once() { [ "$(said "$1" | wc -l)" = 1 ] && ! grep -qi 'backtrace\|SIGSEGV' "$1"; }

scene() { # scene CELL DIRECTORY
   cat <<SCENE
&scene title='a block', end_time=0.01 /
&grid lower=0,0,0, upper=2.4,1.6,1.6, cell_size=$1 /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0.4,0.4,0.4, upper=1.2,1.2,1.2, velocity=1,0,0 /
&output directory='$2' /
&checkpoint /
SCENE
}
scene 0.2 out >small.nml

# one rank where more were launched
refused() { # refused VARIABLE=NUMBER
   rm -rf out
   env "$1" "$GIMP3D" <small.nml >launch.log 2>&1
   status=$?
   check "$1: status $status, $(said launch.log | cut -c 1-90)" [ $status = 2 -a ! -e out ]
   check 'one sentence that names the variable' eval "once launch.log && grep -q '(${1%%=*})' launch.log"
}
for variable in PMI_SIZE=2 OMPI_COMM_WORLD_SIZE=4 MV2_COMM_WORLD_SIZE=2 SLURM_STEP_NUM_TASKS=64; do refused $variable; done
started() { # started SENTENCE VARIABLE=NUMBER...: it runs
   what=$1
   shift
   env "$@" "$GIMP3D" <small.nml >launch.log 2>&1
   status=$?
   check "$*: $what, status $status" [ $status = 0 ]
}
started 'one rank was asked for' PMI_SIZE=1 SLURM_STEP_NUM_TASKS=64
check 'without a warning' [ -z "$(grep '^warning .*tasks' launch.log)" ]
started 'one rank in a job of more may be meant' SLURM_NTASKS=64
check "with a warning: $(grep '^warning .*tasks' launch.log)" grep -q '^warning .*64 tasks' launch.log
PMI_SIZE=2 SLURM_NTASKS=2 mpirun -n 2 "$GIMP3D" <small.nml >launch.log 2>&1
check "on two ranks all is well: status $?" grep -q '^finished' launch.log

# limits of memory; the tools of the debug build take more than any of them
if [ "$BUILD" != debug ]; then
   for ranks in 1 2; do
      (ulimit -v 1000000; mpirun -n $ranks "$GIMP3D" <small.nml >memory.log 2>&1)
      check "1 GB of address space on $ranks: $(tail -n 1 memory.log)" grep -q '^finished' memory.log
   done
   scene 0.0125 large >large.nml
   (ulimit -v 500000; "$GIMP3D" <large.nml >memory.log 2>&1)
   status=$?
   check "too little for the particles: status $status, $(said memory.log)" [ $status = 2 -a ! -e large ]
   check 'one sentence' once memory.log
   # tables of blocks grow with the finest cells, however few there are
   cat >deep.nml <<'EOF'
&scene title='eight levels', end_time=1e-3 /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.1 /
&level lower=0,0,0, upper=3*0.8 /
&level lower=0,0,0, upper=3*0.7 /
&level lower=0,0,0, upper=3*0.65 /
&level lower=0,0,0, upper=3*0.625 /
&level lower=0,0,0, upper=3*0.6125 /
&level lower=0,0,0, upper=3*0.60625 /
&level lower=0,0,0, upper=3*0.603125 /
&level lower=0,0,0, upper=3*0.6015625 /
&material name='m', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='m', shape='box', lower=0.85,0.85,0.85, upper=0.95,0.95,0.95, particles_per_cell=1 /
&output directory='deep', formats='none' /
EOF
   (ulimit -v 1000000; "$GIMP3D" <deep.nml >memory.log 2>&1)
   status=$?
   check "too little for tables: status $status, $(said memory.log)" [ $status = 2 -a ! -e deep ]
   check 'one sentence' once memory.log
   # enough for the particles, not for a snapshot of them: the first limit that is not refused at once
   scene 0.02 large >large.nml
   for ranks in 1 2; do
      limit=320000 status=2
      while [ $status = 2 ] && [ $limit -lt 600000 ]; do
         rm -rf large
         limit=$((limit + 40000 / ranks))
         (ulimit -v $limit; mpirun -n $ranks "$GIMP3D" <large.nml >memory.log 2>&1)
         status=$?
      done
      check "too little later, $limit kB on $ranks: status $status, $(said memory.log | head -n 1)" [ $status = 3 ]
      check 'no backtrace' [ -z "$(grep -i 'backtrace\|SIGSEGV' memory.log)" ]
      check 'the directory is free again' [ ! -e large/run.lock ]
   done
fi

# a file system without locks
if ${CC:-cc} -shared -fPIC -o no_locks.so "$ROOT/test/hostile/no_locks.c" -ldl 2>compiler.log; then
   [ "$BUILD" = debug ] && asan=$(gcc -print-file-name=libasan.so): || asan=
   for ranks in 1 2; do
      mpirun -n $ranks -x LD_PRELOAD="$asan$PWD/no_locks.so" "$GIMP3D" <small.nml >locks.log 2>&1
      check "no locks on $ranks: $(tail -n 1 locks.log)" grep -q '^finished' locks.log
      mpirun -n $ranks -x LD_PRELOAD="$asan$PWD/no_locks.so" -x HDF5_USE_FILE_LOCKING=TRUE "$GIMP3D" <small.nml >locks.log 2>&1
      status=$?
      check "locks that HDF5 is told to take: status $status, $(said locks.log)" [ $status = 4 ]
      check 'one sentence that names them' eval "once locks.log && grep -q 'refuses to lock .*HDF5_USE_FILE_LOCKING=FALSE' locks.log"
   done
else
   echo '   no C compiler: file systems without locks are left out'
fi
exit $failed
