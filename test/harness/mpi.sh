# How the tests run MPI, read by test/run and env.sh: as root, in containers, with more ranks than cores, on one machine. What the
# user has set stands. Open MPI 4 reads OMPI_MCA_..., of Open MPI 5 the launcher PRTE_MCA_..., the library OMPI_MCA_...
export OMPI_ALLOW_RUN_AS_ROOT="${OMPI_ALLOW_RUN_AS_ROOT:-1}" OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="${OMPI_ALLOW_RUN_AS_ROOT_CONFIRM:-1}"
export OMPI_MCA_rmaps_base_oversubscribe="${OMPI_MCA_rmaps_base_oversubscribe:-1}"
export PRTE_MCA_rmaps_default_mapping_policy="${PRTE_MCA_rmaps_default_mapping_policy:-:oversubscribe}"
export OMPI_MCA_hwloc_base_binding_policy="${OMPI_MCA_hwloc_base_binding_policy:-none}"
export PRTE_MCA_hwloc_default_binding_policy="${PRTE_MCA_hwloc_default_binding_policy:-none}"
# Messages go through shared memory, which 5 calls sm and vader too, and no network is looked for: a launch takes half the time,
# and 5 complains of none that reaches itself.
export OMPI_MCA_pml="${OMPI_MCA_pml:-ob1}" OMPI_MCA_btl="${OMPI_MCA_btl:-self,vader}"
export OMPI_MCA_btl_vader_single_copy_mechanism="${OMPI_MCA_btl_vader_single_copy_mechanism:-none}" OMPI_MCA_smsc="${OMPI_MCA_smsc:-^cma}"
case ${BUILD:-} in *_coarray) export OMPI_MCA_osc="${OMPI_MCA_osc:-pt2pt}" ;; esac # coarrays work with it on one rank too
# leaks are of Open MPI itself; frames that gfortran 14 would put on the heap cannot hold the code by which internal procedures
# are passed on
export ASAN_OPTIONS="${ASAN_OPTIONS:-detect_leaks=0:detect_stack_use_after_return=0}"
export OMPI_MCA_ess_singleton_isolated="${OMPI_MCA_ess_singleton_isolated:-1}" # a program run without mpirun starts no daemon
[ "${BUILD:-}" != debug ] || export PETSC_OPTIONS="${PETSC_OPTIONS:--no_signal_handler}" # else PETSc hides the line of a fault
