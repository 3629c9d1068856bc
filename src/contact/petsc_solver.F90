!> Bound-constrained quadratic problems on PETSc: minimise 1/2 x'Mx - b'x over x >= 0, M given by its product.
!> The only module that includes PETSc. Its solver is TAO's gradient projection with conjugate gradients (Moré and Toraldo 1991).
module m_petsc_solver
#include <petsc/finclude/petsctao.h>
#undef MPI_Comm
   use petsctao
   use m_kinds, only: wp
   use m_petsc_operator, only: petsc_operator_t
   implicit none
   private
   public :: petsc_solver_t

   !> Solver objects, kept from step to step while the number of unknowns fits.
   type :: petsc_solver_t
      private
      logical :: started = .false.       !< this code has initialised PETSc
      integer, public :: capacity = -1   !< unknowns on this rank that the objects hold
      Vec :: solution, right_side, lower, upper, work
      Mat :: hessian
      Tao :: tao
   contains
      procedure, public :: fit
      procedure, public :: solve
      procedure, public :: release
   end type petsc_solver_t

   !> What PETSc's callbacks work on during a solve.
   class(petsc_operator_t), pointer, protected :: current_operator => null()
   Vec, protected :: current_right_side

contains

   !> Collective: objects for `unknowns` on this rank. Initialises PETSc at the first call.
   subroutine fit(self, comm, unknowns)
      class(petsc_solver_t), intent(inout) :: self
      integer, intent(in) :: comm     !< the handle of the communicator
      integer, intent(in) :: unknowns !< on this rank; may be 0
      PetscErrorCode :: ierr
      PetscInt :: n
      if (.not. self%started) then
         PETSC_COMM_WORLD = comm
         call PetscInitialize(PETSC_NULL_CHARACTER, ierr)
         self%started = .true.
      end if
      if (self%capacity >= 0) call destroy(self)
      n = unknowns
      call VecCreateMPI(comm, n, PETSC_DETERMINE, self%solution, ierr)
      call VecDuplicate(self%solution, self%right_side, ierr)
      call VecDuplicate(self%solution, self%lower, ierr)
      call VecDuplicate(self%solution, self%upper, ierr)
      call VecDuplicate(self%solution, self%work, ierr)
      call VecSet(self%lower, 0.0_wp, ierr)
      call VecSet(self%upper, PETSC_INFINITY, ierr)
      call MatCreateShell(comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 0, self%hessian, ierr)
      call MatShellSetOperation(self%hessian, MATOP_MULT, multiply, ierr)
      call MatSetOption(self%hessian, MAT_SYMMETRIC, PETSC_TRUE, ierr)
      call TaoCreate(comm, self%tao, ierr)
      call TaoSetType(self%tao, TAOGPCG, ierr)
      call TaoSetSolution(self%tao, self%solution, ierr)
      call TaoSetVariableBounds(self%tao, self%lower, self%upper, ierr)
      call TaoSetObjectiveAndGradient(self%tao, PETSC_NULL_VEC, objective_and_gradient, 0, ierr)
      call TaoSetHessian(self%tao, self%hessian, self%hessian, keep_hessian, 0, ierr)
      call PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-tao_subset_type', 'matrixfree', ierr)
      call PetscOptionsSetValue(PETSC_NULL_OPTIONS, '-pc_type', 'none', ierr)
      call TaoSetFromOptions(self%tao, ierr)
      self%capacity = unknowns
   end subroutine fit

   !> Collective: x from its start value; unknowns beyond size(x) are idle. `residual` is the norm of the projected gradient
   !> relative to that of b.
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
      PetscReal :: size_of_b, norm, objective, infeasibility, change
      PetscInt :: steps, limit
      TaoConvergedReason :: reason
      current_operator => operator
      current_right_side = self%right_side
      call fill(self%right_side, b)
      call fill(self%solution, x)
      call VecNorm(self%right_side, NORM_2, size_of_b, ierr)
      limit = max_iterations
      call TaoSetTolerances(self%tao, tolerance*size_of_b, 0.0_wp, 0.0_wp, ierr)
      call TaoSetMaximumIterations(self%tao, limit, ierr)
      call TaoSolve(self%tao, ierr)
      call TaoGetSolutionStatus(self%tao, steps, objective, norm, infeasibility, change, reason, ierr)
      iterations = steps
      residual = norm/max(size_of_b, tiny(size_of_b))
      call VecGetArrayReadF90(self%solution, values, ierr)
      x = max(values(:size(x)), 0.0_wp)
      call VecRestoreArrayReadF90(self%solution, values, ierr)
      nullify (current_operator)
   end subroutine solve

   !> Put values at the head of a vector and zero behind them.
   subroutine fill(vector, values)
      Vec :: vector
      real(wp), intent(in) :: values(:)
      PetscScalar, pointer :: array(:)
      PetscErrorCode :: ierr
      call VecGetArrayF90(vector, array, ierr)
      array(:size(values)) = values
      array(size(values) + 1:) = 0.0_wp
      call VecRestoreArrayF90(vector, array, ierr)
   end subroutine fill

   !> PETSc's product with the matrix. Idle unknowns keep their value.
   subroutine multiply(matrix, x, y, ierr)
      Mat :: matrix
      Vec :: x, y
      PetscErrorCode :: ierr
      PetscScalar, pointer :: from(:), to(:)
      call VecGetArrayReadF90(x, from, ierr)
      call VecGetArrayF90(y, to, ierr)
      call current_operator%multiply(from, to)
      call VecRestoreArrayReadF90(x, from, ierr)
      call VecRestoreArrayF90(y, to, ierr)
   end subroutine multiply

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
      call VecDot(x, gradient, quadratic, ierr)
      call VecDot(x, current_right_side, linear, ierr)
      value = 0.5_wp*quadratic - linear
      call VecAXPY(gradient, -1.0_wp, current_right_side, ierr)
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

   subroutine destroy(self)
      class(petsc_solver_t), intent(inout) :: self
      PetscErrorCode :: ierr
      call TaoDestroy(self%tao, ierr)
      call MatDestroy(self%hessian, ierr)
      call VecDestroy(self%solution, ierr)
      call VecDestroy(self%right_side, ierr)
      call VecDestroy(self%lower, ierr)
      call VecDestroy(self%upper, ierr)
      call VecDestroy(self%work, ierr)
      self%capacity = -1
   end subroutine destroy

   !> Collective: free everything; PETSc is finalised if this code had started it.
   subroutine release(self)
      class(petsc_solver_t), intent(inout) :: self
      PetscErrorCode :: ierr
      if (self%capacity >= 0) call destroy(self)
      if (self%started) call PetscFinalize(ierr)
      self%started = .false.
   end subroutine release

end module m_petsc_solver
