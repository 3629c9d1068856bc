! Where versions of PETSc differ, 3.18 to 3.26: a source includes this behind PETSc's own headers.

! No list of integers.
#if PETSC_VERSION_LT(3,22,0)
#define NO_COUNTS PETSC_NULL_INTEGER
#else
#define NO_COUNTS PETSC_NULL_INTEGER_ARRAY
#endif

! Why a solver ended, as a number: below 0 where it failed.
#if PETSC_VERSION_LT(3,23,0)
#define NUMBER_OF(reason) reason
#else
#define NUMBER_OF(reason) reason%v
#endif

! Values as a Fortran pointer.
#if PETSC_VERSION_GE(3,23,0)
#undef VecGetArrayF90
#undef VecRestoreArrayF90
#undef VecGetArrayReadF90
#undef VecRestoreArrayReadF90
#define VecGetArrayF90 VecGetArray
#define VecRestoreArrayF90 VecRestoreArray
#define VecGetArrayReadF90 VecGetArrayRead
#define VecRestoreArrayReadF90 VecRestoreArrayRead
#endif
