!> Bound-constrained quadratic problems on PETSc: minimise 1/2 x'Mx - b'x over x >= 0, M given by its product.
!> An error inside PETSc aborts all ranks with PETSc's message. First an active-set method, with PETSc's
!> conjugate gradients for the free unknowns; where it cycles, TAO's gradient projection with conjugate
!> gradients (Moré and Toraldo 1991). That solves for the change from the start value: the decrease of the
!> objective is then no difference of large numbers, whose round-off would disturb the line searches for a
!> good start.
module m_petsc_solver
#include <petsc/finclude/petsctao.h>
#include "../parallel/petsc_versions.h"
#undef MPI_Comm
   use petsctao
   use m_kinds, only: wp, i8
   use m_petsc_operator, only: petsc_operator_t
   use m_petsc_session, only: begin_petsc, end_petsc
   implicit none
   private
   public :: petsc_solver_t

   !> Solver objects, kept from step to step while the number of unknowns fits.
   type :: petsc_solver_t
      private
      logical :: started = .false.       !< this solver has initialised PETSc
      integer, public :: capacity = -1   !< number of unknowns on this rank that the objects hold
      integer, public :: guesses = 8     !< active-set iterations before gradient projection is used
      integer(i8), public :: projected = 0 !< problems in which it was used
      Vec :: b, start, change, right_side, lower, upper
      Mat :: hessian, free_hessian
      Tao :: tao
      KSP :: ksp
   contains
      procedure, public :: fit
      procedure, private :: dismiss
      procedure, public :: solve
      procedure, public :: solve_among
      procedure, public :: release
   end type petsc_solver_t

   real(wp), parameter :: largest_right_side = 1.0e100_wp !< limit of its norm; above it, or for NaN, there is
                                                          !< no solution
   integer, parameter :: together = 25              !< iterations after which the change so far becomes the
                                                    !< start
   real(wp), parameter :: rough = 0.001_wp          !< tolerance of the conjugate gradients of one active-set
                                                    !< iteration, relative to their initial residual
   integer, parameter :: many = 10000               !< maximum number of products for one active set (PETSc's
                                                    !< default)
   real(wp), parameter :: rounding = 1.0e-13_wp     !< of the largest unknown
   PetscReal, parameter :: by_default = PETSC_DEFAULT_REAL
   real(wp), parameter :: enough = 0.3_wp           !< tolerance of the conjugate gradients relative to the
                                                    !< tolerance of the problem; with 0.9, friction's sweeps
                                                    !< soon exceed it again

   !> Data of PETSc's callbacks during a solve.
   class(petsc_operator_t), pointer, protected :: current_operator => null()
   Vec, protected :: current_right_side

contains

   !> Collective: create objects for `unknowns` on this rank.
   subroutine fit(self, comm, unknowns)
      class(petsc_solver_t), intent(inout) :: self
      integer, intent(in) :: comm     !< Fortran handle of their communicator
      integer, intent(in) :: unknowns !< on this rank; may be 0
      PetscErrorCode :: ierr
      PetscInt :: n
      PC :: preconditioner
      call begin_petsc(comm, self%started)
      call self%dismiss()
      n = unknowns
      PetscCallA(VecCreateMPI(comm, n, PETSC_DETERMINE, self%change, ierr))
      PetscCallA(VecDuplicate(self%change, self%b, ierr))
      PetscCallA(VecDuplicate(self%change, self%start, ierr))
      PetscCallA(VecDuplicate(self%change, self%right_side, ierr))
      PetscCallA(VecDuplicate(self%change, self%lower, ierr))
      PetscCallA(VecDuplicate(self%change, self%upper, ierr))
      PetscCallA(VecSet(self%upper, PETSC_INFINITY, ierr))
      PetscCallA(MatCreateShell(comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 0, self%hessian, ierr))
      PetscCallA(MatShellSetOperation(self%hessian, MATOP_MULT, multiply, ierr))
      PetscCallA(MatSetOption(self%hessian, MAT_SYMMETRIC, PETSC_TRUE, ierr))
      PetscCallA(TaoCreate(comm, self%tao, ierr))
      ! these options apply to no other solver
      PetscCallA(TaoSetOptionsPrefix(self%tao, 'contact_', ierr))
      PetscCallA(TaoSetType(self%tao, TAOGPCG, ierr))
      PetscCallA(TaoSetSolution(self%tao, self%change, ierr))
      PetscCallA(TaoSetVariableBounds(self%tao, self%lower, self%upper, ierr))
      PetscCallA(TaoSetObjectiveAndGradient(self%tao, PETSC_NULL_VEC, objective_and_gradient, 0, ierr))
      PetscCallA(TaoSetHessian(self%tao, self%hessian, self%hessian, keep_hessian, 0, ierr))
      PetscCallA(PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-contact_tao_subset_type', 'matrixfree', ierr))
      PetscCallA(PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-contact_pc_type', 'none', ierr))
      ! conjugate gradients without a trust region, which this Tao does not use: its norms would take three
      ! more reductions per product
      PetscCallA(PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-contact_ksp_type', 'cg', ierr))
      ! without a preconditioner the natural norm is that of the residual, and available: one reduction fewer
      ! per product
      PetscCallA(PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-contact_ksp_norm_type', 'natural', ierr))
      PetscCallA(TaoSetFromOptions(self%tao, ierr))
      PetscCallA(MatCreateShell(comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 0, self%free_hessian, ierr))
      PetscCallA(MatShellSetOperation(self%free_hessian, MATOP_MULT, multiply_free, ierr))
      PetscCallA(MatSetOption(self%free_hessian, MAT_SYMMETRIC, PETSC_TRUE, ierr))
      PetscCallA(KSPCreate(comm, self%ksp, ierr))
      PetscCallA(KSPSetType(self%ksp, KSPCG, ierr))
      PetscCallA(KSPSetNormType(self%ksp, KSP_NORM_NATURAL, ierr))
      PetscCallA(KSPGetPC(self%ksp, preconditioner, ierr))
      PetscCallA(PCSetType(preconditioner, PCNONE, ierr))
      PetscCallA(KSPSetOperators(self%ksp, self%free_hessian, self%free_hessian, ierr))
      self%capacity = unknowns
   end subroutine fit

   !> Collective: solve for x from its start value; unknowns beyond size(x) are idle. `residual` is the norm
   !> of the projected gradient relative to that of b; huge, and x unchanged, if b has no finite norm.
   subroutine solve(self, operator, b, x, tolerance, max_iterations, iterations, residual)
      class(petsc_solver_t), intent(inout) :: self
      class(petsc_operator_t), intent(inout), target :: operator
      real(wp), intent(in) :: b(:)
      real(wp), intent(inout) :: x(:)
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: max_iterations
      integer, intent(out) :: iterations
      real(wp), intent(out) :: residual
      PetscScalar, pointer :: values(:)
      PetscErrorCode :: ierr
      PetscReal :: size_of_b, norm
      current_operator => operator
      iterations = 0
      call fill(self%b, b)
      PetscCallA(VecNorm(self%b, NORM_2, size_of_b, ierr))
      if (.not. size_of_b <= largest_right_side) then ! on all ranks: else PETSc would abort
         residual = huge(residual)
         nullify (current_operator)
         return
      end if
      call fill(self%start, max(x, 0.0_wp))
      call solve_free(self, tolerance*size_of_b, max_iterations, iterations, norm)
      if (.not. norm <= tolerance*size_of_b .and. iterations < max_iterations) &
         call solve_bounded(self, tolerance*size_of_b, max_iterations, iterations, norm)
      residual = norm/max(size_of_b, tiny(size_of_b))
      PetscCallA(VecGetArrayReadF90(self%start, values, ierr))
      x = values(:size(x))
      PetscCallA(VecRestoreArrayReadF90(self%start, values, ierr))
      nullify (current_operator)
   end subroutine solve

   !> Collective: solve M x = b for the given free unknowns, by conjugate gradients from 0; the others are 0.
   !> `residual` is relative to b; huge, and x is 0, if b has no finite norm.
   subroutine solve_among(self, operator, free, b, x, tolerance, max_iterations, residual)
      class(petsc_solver_t), intent(inout) :: self
      class(petsc_operator_t), intent(inout), target :: operator
      logical, intent(in) :: free(:) !< (unknowns)
      real(wp), intent(in) :: b(:)
      real(wp), intent(out) :: x(:)
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: max_iterations
      real(wp), intent(out) :: residual
      PetscScalar, pointer :: values(:)
      PetscErrorCode :: ierr
      PetscReal :: size_of_b, norm
      PetscInt :: limit
      x = 0.0_wp
      residual = huge(residual)
      call fill(self%right_side, merge(b, 0.0_wp, free))
      PetscCallA(VecNorm(self%right_side, NORM_2, size_of_b, ierr))
      if (.not. size_of_b <= largest_right_side) return ! on all ranks: else PETSc would abort
      current_operator => operator
      call operator%set_free(free)
      limit = max_iterations
      PetscCallA(KSPSetTolerances(self%ksp, tolerance, tiny(size_of_b), by_default, limit, ierr))
      PetscCallA(KSPSolve(self%ksp, self%right_side, self%change, ierr))
      PetscCallA(KSPGetResidualNorm(self%ksp, norm, ierr))
      limit = many ! as for active sets
      PetscCallA(KSPSetTolerances(self%ksp, tolerance, tiny(size_of_b), by_default, limit, ierr))
      residual = norm/max(size_of_b, tiny(size_of_b))
      PetscCallA(VecGetArrayReadF90(self%change, values, ierr))
      x = values(:size(x))
      PetscCallA(VecRestoreArrayReadF90(self%change, values, ierr))
      nullify (current_operator)
   end subroutine solve_among

   !> Choose the free unknowns, solve for them, and update the choice by the signs of unknowns and gradient: a
   !> primal-dual active set method (Hintermüller, Ito and Kunisch 2003), whose first choice is mostly right,
   !> since the start is from the last steps. It may cycle; then `norm`, that of the projected gradient, is
   !> above `tolerance`, or NaN.
   subroutine solve_free(self, tolerance, max_iterations, iterations, norm)
      class(petsc_solver_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: max_iterations
      integer, intent(inout) :: iterations
      PetscReal, intent(out) :: norm
      PetscReal :: lowest
      PetscScalar, pointer :: x(:), b(:), gradient(:), change(:)
      logical :: free(self%capacity)
      PetscErrorCode :: ierr
      KSPConvergedReason :: reason
      do
         call multiply(self%hessian, self%start, self%right_side, ierr)
         PetscCallA(VecGetArrayF90(self%start, x, ierr))
         PetscCallA(VecGetArrayReadF90(self%b, b, ierr))
         PetscCallA(VecGetArrayF90(self%right_side, gradient, ierr))
         gradient = gradient - b
         free = x > 0.0_wp .or. .not. gradient >= 0.0_wp ! NaN must show in the norm
         gradient = merge(-gradient, 0.0_wp, free)
         PetscCallA(VecRestoreArrayF90(self%right_side, gradient, ierr))
         PetscCallA(VecRestoreArrayReadF90(self%b, b, ierr))
         PetscCallA(VecRestoreArrayF90(self%start, x, ierr))
         PetscCallA(VecNorm(self%right_side, NORM_2, norm, ierr))
         if (norm <= tolerance .or. iterations >= min(self%guesses, max_iterations)) return
         ! the start is so bad that PETSc would abort: leave it to gradient projection
         if (.not. norm <= largest_right_side) return
         call current_operator%set_free(free)
         lowest = max(enough*tolerance, rough*norm)
         PetscCallA(KSPSetTolerances(self%ksp, 1.0e-30_wp, lowest, by_default, PETSC_DEFAULT_INTEGER, ierr))
         PetscCallA(KSPSolve(self%ksp, self%right_side, self%change, ierr))
         PetscCallA(KSPGetConvergedReason(self%ksp, reason, ierr))
         iterations = iterations + 1
         if (NUMBER_OF(reason) < 0) return
         PetscCallA(VecGetArrayF90(self%start, x, ierr))
         PetscCallA(VecGetArrayReadF90(self%change, change, ierr))
         x = max(0.0_wp, x + change)
         PetscCallA(VecRestoreArrayReadF90(self%change, change, ierr))
         PetscCallA(VecRestoreArrayF90(self%start, x, ierr))
      end do
   end subroutine solve_free

   !> Gradient projection with conjugate gradients (TAO's GPCG), from the values in `start`.
   subroutine solve_bounded(self, tolerance, max_iterations, iterations, norm)
      class(petsc_solver_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance
      integer, intent(in) :: max_iterations
      integer, intent(inout) :: iterations
      PetscReal, intent(out) :: norm
      PetscErrorCode :: ierr
      PetscReal :: objective, infeasible, change
      PetscInt :: steps, limit
      KSP :: ksp
      TaoConvergedReason :: reason
      self%projected = self%projected + 1
      current_right_side = self%right_side
      PetscCallA(TaoSetTolerances(self%tao, tolerance, 0.0_wp, 0.0_wp, ierr))
      PetscCallA(TaoGetKSP(self%tao, ksp, ierr))
      PetscCallA(KSPSetTolerances(ksp, by_default, enough*tolerance, by_default, PETSC_DEFAULT_INTEGER, ierr))
      do
         call begin(self)
         limit = min(together, max_iterations - iterations)
         PetscCallA(TaoSetMaximumIterations(self%tao, limit, ierr))
         PetscCallA(TaoSolve(self%tao, ierr))
         PetscCallA(TaoGetSolutionStatus(self%tao, steps, objective, norm, infeasible, change, reason, ierr))
         iterations = iterations + steps
         call go_on(self%start, self%change)
         if (norm <= tolerance .or. iterations >= max_iterations .or. steps == 0) exit
      end do
   end subroutine solve_bounded

   !> Set up the problem of the change from the start: its right-hand side b - M start, and bounds that keep
   !> the sum at or above 0. A start that is worse than zero is set to 0: else the decrease of the objective
   !> would be mostly that of the start.
   subroutine begin(self)
      class(petsc_solver_t), intent(inout) :: self
      PetscScalar :: quadratic, linear
      PetscErrorCode :: ierr
      call multiply(self%hessian, self%start, self%change, ierr)
      PetscCallA(VecDot(self%start, self%change, quadratic, ierr))
      PetscCallA(VecDot(self%start, self%b, linear, ierr))
      if (.not. 0.5_wp*quadratic <= linear) then ! or NaN
         PetscCallA(VecSet(self%start, 0.0_wp, ierr))
         PetscCallA(VecSet(self%change, 0.0_wp, ierr))
      end if
      PetscCallA(VecWAXPY(self%right_side, -1.0_wp, self%change, self%b, ierr))
      PetscCallA(VecSet(self%change, 0.0_wp, ierr))
      PetscCallA(VecCopy(self%start, self%lower, ierr))
      PetscCallA(VecScale(self%lower, -1.0_wp, ierr))
   end subroutine begin

   !> Add the change to the start. Unknowns that are only round-off are set to 0: gradient projection would
   !> treat them as free ones that must not decrease, and then no step is short enough.
   subroutine go_on(start, change)
      Vec :: start, change
      PetscScalar, pointer :: array(:)
      PetscReal :: largest
      PetscErrorCode :: ierr
      PetscCallA(VecAXPY(start, 1.0_wp, change, ierr))
      PetscCallA(VecNorm(start, NORM_INFINITY, largest, ierr))
      PetscCallA(VecGetArrayF90(start, array, ierr))
      where (array <= rounding*largest) array = 0.0_wp
      PetscCallA(VecRestoreArrayF90(start, array, ierr))
   end subroutine go_on

   !> Copy values to the beginning of a vector, and pad it with zeros.
   subroutine fill(vector, values)
      Vec :: vector
      real(wp), intent(in) :: values(:)
      PetscScalar, pointer :: array(:)
      PetscErrorCode :: ierr
      PetscCallA(VecGetArrayF90(vector, array, ierr))
      array(:size(values)) = values
      array(size(values) + 1:) = 0.0_wp
      PetscCallA(VecRestoreArrayF90(vector, array, ierr))
   end subroutine fill

   !> PETSc's callback for the product with the matrix. Idle unknowns keep their value.
   subroutine multiply(matrix, x, y, ierr)
      Mat :: matrix
      Vec :: x, y
      PetscErrorCode :: ierr
      PetscScalar, pointer :: from(:), to(:)
      PetscCallA(VecGetArrayReadF90(x, from, ierr))
      PetscCallA(VecGetArrayF90(y, to, ierr))
      call current_operator%multiply(from, to)
      PetscCallA(VecRestoreArrayReadF90(x, from, ierr))
      PetscCallA(VecRestoreArrayF90(y, to, ierr))
   end subroutine multiply

   !> The same between free unknowns.
   subroutine multiply_free(matrix, x, y, ierr)
      Mat :: matrix
      Vec :: x, y
      PetscErrorCode :: ierr
      PetscScalar, pointer :: from(:), to(:)
      PetscCallA(VecGetArrayReadF90(x, from, ierr))
      PetscCallA(VecGetArrayF90(y, to, ierr))
      call current_operator%multiply_free(from, to)
      PetscCallA(VecRestoreArrayReadF90(x, from, ierr))
      PetscCallA(VecRestoreArrayF90(y, to, ierr))
   end subroutine multiply_free

   !> 1/2 x'Mx - b'x and Mx - b.
   subroutine objective_and_gradient(tao_, x, value, gradient, context, ierr)
      Tao :: tao_
      Vec :: x, gradient
      PetscReal :: value
      integer :: context
      PetscErrorCode :: ierr
      PetscScalar :: quadratic, linear
      Mat :: none
      none = PETSC_NULL_MAT
      call multiply(none, x, gradient, ierr)
      PetscCallA(VecDot(x, gradient, quadratic, ierr))
      PetscCallA(VecDot(x, current_right_side, linear, ierr))
      value = 0.5_wp*quadratic - linear
      PetscCallA(VecAXPY(gradient, -1.0_wp, current_right_side, ierr))
   end subroutine objective_and_gradient

   !> The matrix does not depend on x.
   subroutine keep_hessian(tao_, x, hessian, preconditioner, context, ierr)
      Tao :: tao_
      Vec :: x
      Mat :: hessian, preconditioner
      integer :: context
      PetscErrorCode :: ierr
      ierr = 0
   end subroutine keep_hessian

   !> Collective: free the objects.
   subroutine dismiss(self)
      class(petsc_solver_t), intent(inout) :: self
      PetscErrorCode :: ierr
      if (self%capacity < 0) return
      PetscCallA(TaoDestroy(self%tao, ierr))
      PetscCallA(KSPDestroy(self%ksp, ierr))
      PetscCallA(MatDestroy(self%free_hessian, ierr))
      PetscCallA(MatDestroy(self%hessian, ierr))
      PetscCallA(VecDestroy(self%b, ierr))
      PetscCallA(VecDestroy(self%start, ierr))
      PetscCallA(VecDestroy(self%change, ierr))
      PetscCallA(VecDestroy(self%right_side, ierr))
      PetscCallA(VecDestroy(self%lower, ierr))
      PetscCallA(VecDestroy(self%upper, ierr))
      self%capacity = -1
   end subroutine dismiss

   !> Collective: free everything; PETSc is finalised if this solver had started it.
   subroutine release(self)
      class(petsc_solver_t), intent(inout) :: self
      call self%dismiss()
      call end_petsc(self%started)
   end subroutine release

end module m_petsc_solver
