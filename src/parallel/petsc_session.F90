!> PETSc is initialised once, by the first module that needs it, and finalised by the same one.
module m_petsc_session
#include <petsc/finclude/petscsys.h>
#undef MPI_Comm
   use petscsys
   use m_signals, only: ignore_closed_pipes
   implicit none
   private
   public :: begin_petsc, end_petsc

contains

   !> Collective: initialise PETSc if that has not happened; `began` tells whether this call did.
   subroutine begin_petsc(comm, began)
      integer, intent(in) :: comm !< Fortran handle of the ranks' communicator
      logical, intent(inout) :: began !< stays true where it is
      PetscErrorCode :: ierr
      PetscBool :: there, given
      PetscCallA(PetscInitialized(there, ierr))
      if (there) return
      PETSC_COMM_WORLD = comm
      PetscCallA(PetscInitialize(PETSC_NULL_CHARACTER, ierr))
      call ignore_closed_pipes() ! PETSc has set a handler that ends the run
      ! PETSc reads the program's own command line too; 3.22 and later warn of what they do not know there
      PetscCallA(PetscOptionsHasName(PETSC_NULL_OPTIONS, PETSC_NULL_CHARACTER, '-options_left', given, ierr))
      if (.not. given) then
         PetscCallA(PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-options_left', 'no', ierr))
      end if
      began = .true.
   end subroutine begin_petsc

   !> Collective: finalise PETSc if this caller initialised it.
   subroutine end_petsc(began)
      logical, intent(inout) :: began
      PetscErrorCode :: ierr
      if (began) then
         PetscCallA(PetscFinalize(ierr))
         call ignore_closed_pipes() ! it has taken its handlers away
      end if
      began = .false.
   end subroutine end_petsc

end module m_petsc_session
