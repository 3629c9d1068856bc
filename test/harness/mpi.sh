# How the tests run MPI, read by test/run and env.sh: as root, in containers, with more ranks than cores, on one machine. What the
# user has set stands.
export OMPI_ALLOW_RUN_AS_ROOT="${OMPI_ALLOW_RUN_AS_ROOT:-1}" OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="${OMPI_ALLOW_RUN_AS_ROOT_CONFIRM:-1}"
export OMPI_MCA_rmaps_base_oversubscribe="${OMPI_MCA_rmaps_base_oversubscribe:-1}"
export OMPI_MCA_hwloc_base_binding_policy="${OMPI_MCA_hwloc_base_binding_policy:-none}"
export OMPI_MCA_btl_vader_single_copy_mechanism="${OMPI_MCA_btl_vader_single_copy_mechanism:-none}"
export OMPI_MCA_pml="${OMPI_MCA_pml:-ob1}" # looks for no network: a launch takes half the time
case ${BUILD:-} in *_coarray) export OMPI_MCA_osc="${OMPI_MCA_osc:-pt2pt}" ;; esac # coarrays work with it on one rank too
export ASAN_OPTIONS="${ASAN_OPTIONS:-detect_leaks=0}" # of Open MPI itself
export OMPI_MCA_ess_singleton_isolated="${OMPI_MCA_ess_singleton_isolated:-1}" # a program run without mpirun starts no daemon
