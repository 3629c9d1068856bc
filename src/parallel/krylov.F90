!> Linear systems given by their product only, solved with PETSc: conjugate gradients, or a method for
!> matrices that are not symmetric, with the diagonal as preconditioner. An error inside PETSc aborts all
!> ranks with PETSc's message. Options of PETSc with the prefix -quasi_static_ change solver and
!> preconditioner.
module m_krylov
#include <petsc/finclude/petscksp.h>
#include "petsc_versions.h"
#undef MPI_Comm
   use petscksp
   use m_kinds, only: wp
   use m_petsc_session, only: begin_petsc, end_petsc
   implicit none
   private
   public :: krylov_t

   !> Interface of a system for the solver.
   type, abstract, public :: krylov_operator_t
   contains
      procedure(product_interface), deferred :: multiply
      procedure :: is_to_stop
   end type krylov_operator_t

   !> Interface of a preconditioner in place of the system's diagonal.
   type, abstract, public :: krylov_preconditioner_t
   contains
      procedure(cycle_interface), deferred :: apply
   end type krylov_preconditioner_t

   abstract interface
      !> Collective: to = an approximate inverse of K times from; symmetric.
      subroutine cycle_interface(self, from, to)
         import :: krylov_preconditioner_t, wp
         class(krylov_preconditioner_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: from(:)
         real(wp), intent(out), contiguous :: to(:)
      end subroutine cycle_interface

      !> Collective: to = K from, for this rank's unknowns.
      subroutine product_interface(self, from, to)
         import :: krylov_operator_t, wp
         class(krylov_operator_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: from(:)
         real(wp), intent(out), contiguous :: to(:)
      end subroutine product_interface
   end interface

   !> Solver objects for a number of unknowns, kept while the number is the same.
   type :: krylov_t
      private
      logical :: started = .false.     !< this solver has initialised PETSc
      integer :: unknowns = -1         !< on this rank
      integer :: comm = 0
      Vec :: right_side, solution
      Mat :: shell
      KSP :: symmetric, general
      logical, public :: stopped = .false. !< the last solve was stopped at the operator's request
   contains
      procedure, public :: fit
      procedure, public :: size => size_of
      procedure, public :: solve
      procedure, public :: dismiss
      procedure, public :: finish
   end type krylov_t

   integer, parameter :: look_every = 10      !< products between two calls of is_to_stop
   real(wp), parameter :: may_grow = 1.0e30_wp !< limit of the growth of the residual
   integer, parameter :: restart = 60         !< restart length of the method for matrices that are not
                                              !< symmetric

   !> Data of PETSc's callbacks during a solve.
   class(krylov_operator_t), pointer :: current_operator => null()
   class(krylov_preconditioner_t), pointer :: current_preconditioner => null()
   real(wp), pointer :: current_diagonal(:) => null()
   integer :: current_products = 0
   logical :: current_symmetric = .false., current_stopped = .false.

contains

   !> Collective: whether to stop a solve, called after a product; `descent`: `from` is a direction of
   !> descent.
   logical function is_to_stop(self, from, to, diagonal, descent)
      class(krylov_operator_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:), to(:), diagonal(:)
      logical, intent(in) :: descent
      is_to_stop = .false.
   end function is_to_stop

   !> Collective: create objects for `unknowns` on this rank; existing ones are kept where they fit on all
   !> ranks.
   subroutine fit(self, comm, unknowns, fits, preconditioned)
      class(krylov_t), intent(inout) :: self
      integer, intent(in) :: comm     !< Fortran handle of the ranks' communicator
      integer, intent(in) :: unknowns !< on this rank; may be 0
      logical, intent(in) :: fits     !< on all ranks the number equals that of the last call
      logical, intent(in) :: preconditioned !< by the preconditioner given with each system, not by the
                                            !< diagonal
      PetscErrorCode :: ierr
      PetscInt :: n
      if (fits .and. self%unknowns == unknowns) return
      call begin_petsc(comm, self%started)
      call self%dismiss()
      n = unknowns
      PetscCallA(VecCreateMPI(comm, n, PETSC_DETERMINE, self%right_side, ierr))
      PetscCallA(VecDuplicate(self%right_side, self%solution, ierr))
      PetscCallA(MatCreateShell(comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 0, self%shell, ierr))
      PetscCallA(MatShellSetOperation(self%shell, MATOP_MULT, multiply, ierr))
      PetscCallA(MatShellSetOperation(self%shell, MATOP_GET_DIAGONAL, get_diagonal, ierr))
      call make(self%symmetric, KSPCG)
      call make(self%general, KSPFGMRES)
      PetscCallA(KSPGMRESSetRestart(self%general, restart, ierr))
      PetscCallA(KSPSetFromOptions(self%symmetric, ierr))
      PetscCallA(KSPSetFromOptions(self%general, ierr))
      self%unknowns = unknowns
   contains
      subroutine make(solver, method)
         KSP :: solver
         character(len=*), intent(in) :: method
         PC :: preconditioner
         PetscCallA(KSPCreate(comm, solver, ierr))
         PetscCallA(KSPSetOptionsPrefix(solver, 'quasi_static_', ierr))
         PetscCallA(KSPSetType(solver, method, ierr))
         PetscCallA(KSPSetNormType(solver, KSP_NORM_UNPRECONDITIONED, ierr))
         PetscCallA(KSPGetPC(solver, preconditioner, ierr))
         if (preconditioned) then
            PetscCallA(PCSetType(preconditioner, PCSHELL, ierr))
            PetscCallA(PCShellSetApply(preconditioner, precondition, ierr))
         else
            PetscCallA(PCSetType(preconditioner, PCJACOBI, ierr))
         end if
         PetscCallA(KSPSetOperators(solver, self%shell, self%shell, ierr))
      end subroutine make
   end subroutine fit

   !> Number of unknowns on this rank that it was created for; -1: none.
   pure integer function size_of(self)
      class(krylov_t), intent(in) :: self
      size_of = self%unknowns
   end function size_of

   !> Collective: x with |b - K x| <= residual, from 0, by conjugate gradients where K is symmetric; the last
   !> iterate if a direction of negative curvature is found first.
   subroutine solve(self, operator, diagonal, preconditioner, b, x, residual, symmetric, most, products, &
                    solved)
      class(krylov_t), intent(inout) :: self
      class(krylov_operator_t), intent(inout), target :: operator
      real(wp), intent(in), target, contiguous :: diagonal(:) !< of K, above 0
      class(krylov_preconditioner_t), intent(inout), target :: preconditioner !< used if fitted as
                                                                              !< `preconditioned`
      real(wp), intent(in) :: b(:)
      real(wp), intent(out) :: x(:)
      real(wp), intent(in) :: residual
      logical, intent(in) :: symmetric
      integer, intent(in) :: most !< maximum number of products
      integer, intent(out) :: products
      logical, intent(out) :: solved
      PetscErrorCode :: ierr
      PetscScalar, pointer :: values(:)
      PetscInt :: its, iteration_cap
      KSPConvergedReason :: reason
      KSP :: solver
      current_operator => operator
      current_diagonal => diagonal
      current_preconditioner => preconditioner
      current_products = 0
      current_symmetric = symmetric
      current_stopped = .false.
      PetscCallA(VecGetArrayF90(self%right_side, values, ierr))
      values = b
      PetscCallA(VecRestoreArrayF90(self%right_side, values, ierr))
      PetscCallA(VecSet(self%solution, 0.0_wp, ierr))
      solver = self%general
      if (symmetric) solver = self%symmetric
      iteration_cap = most
      ! the operator has changed: without this PETSc would use the diagonal of the first solve for all others
      PetscCallA(MatAssemblyBegin(self%shell, MAT_FINAL_ASSEMBLY, ierr))
      PetscCallA(MatAssemblyEnd(self%shell, MAT_FINAL_ASSEMBLY, ierr))
      PetscCallA(KSPSetOperators(solver, self%shell, self%shell, ierr))
      PetscCallA(KSPSetTolerances(solver, 1.0e-30_wp, residual, may_grow, iteration_cap, ierr))
      PetscCallA(KSPSolve(solver, self%right_side, self%solution, ierr))
      PetscCallA(KSPGetConvergedReason(solver, reason, ierr))
      PetscCallA(KSPGetIterationNumber(solver, its, ierr))
      products = its
      solved = NUMBER_OF(reason) > 0
      PetscCallA(VecGetArrayReadF90(self%solution, values, ierr))
      x = values
      PetscCallA(VecRestoreArrayReadF90(self%solution, values, ierr))
      self%stopped = current_stopped
      if (self%stopped) solved = .false.
      nullify (current_operator, current_diagonal, current_preconditioner)
   end subroutine solve

   !> PETSc's callback for the product with the matrix. A product of 0 ends both methods at once: so a solve
   !> is stopped.
   subroutine multiply(matrix, x, y, ierr)
      Mat :: matrix
      Vec :: x, y
      PetscErrorCode :: ierr
      PetscScalar, pointer :: from(:), to(:)
      PetscCallA(VecGetArrayReadF90(x, from, ierr))
      PetscCallA(VecGetArrayF90(y, to, ierr))
      if (.not. current_stopped) then
         call current_operator%multiply(from, to)
         current_products = current_products + 1
         if (mod(current_products, look_every) == 0) &
            current_stopped = current_operator%is_to_stop(from, to, current_diagonal, current_symmetric)
      end if
      if (current_stopped) to = 0.0_wp
      PetscCallA(VecRestoreArrayReadF90(x, from, ierr))
      PetscCallA(VecRestoreArrayF90(y, to, ierr))
   end subroutine multiply

   !> PETSc's callback for the preconditioner.
   subroutine precondition(its, x, y, ierr)
      PC :: its
      Vec :: x, y
      PetscErrorCode :: ierr
      PetscScalar, pointer :: from(:), to(:)
      PetscCallA(VecGetArrayReadF90(x, from, ierr))
      PetscCallA(VecGetArrayF90(y, to, ierr))
      call current_preconditioner%apply(from, to)
      PetscCallA(VecRestoreArrayReadF90(x, from, ierr))
      PetscCallA(VecRestoreArrayF90(y, to, ierr))
   end subroutine precondition

   subroutine get_diagonal(matrix, d, ierr)
      Mat :: matrix
      Vec :: d
      PetscErrorCode :: ierr
      PetscScalar, pointer :: values(:)
      PetscCallA(VecGetArrayF90(d, values, ierr))
      values = current_diagonal
      PetscCallA(VecRestoreArrayF90(d, values, ierr))
   end subroutine get_diagonal

   !> Collective: free the objects.
   subroutine dismiss(self)
      class(krylov_t), intent(inout) :: self
      PetscErrorCode :: ierr
      if (self%unknowns < 0) return
      PetscCallA(KSPDestroy(self%symmetric, ierr))
      PetscCallA(KSPDestroy(self%general, ierr))
      PetscCallA(MatDestroy(self%shell, ierr))
      PetscCallA(VecDestroy(self%right_side, ierr))
      PetscCallA(VecDestroy(self%solution, ierr))
      self%unknowns = -1
   end subroutine dismiss

   !> Collective: finalise PETSc if this solver initialised it, after all others have freed their PETSc
   !> objects.
   subroutine finish(self)
      class(krylov_t), intent(inout) :: self
      call end_petsc(self%started)
   end subroutine finish

end module m_krylov
