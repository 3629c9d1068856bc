!> Algebraic multigrid (PETSc's GAMG) for an element matrix with three values per node, whose coarse spaces
!> contain the rigid-body motions. Options of PETSc with the prefix -quasi_static_multigrid_ change it.
module m_multigrid
#include <petsc/finclude/petscksp.h>
#include "../parallel/petsc_versions.h"
#undef MPI_Comm
   use petscksp
   use m_kinds, only: wp
   implicit none
   private
   public :: multigrid_t

   !> Values of this rank are ordered by node, with the ranks' numbering of their nodes.
   type :: multigrid_t
      private
      logical :: made = .false.
      Mat :: matrix
      Vec :: from, to
      PC :: cycle
   contains
      procedure, public :: begin
      procedure, public :: add
      procedure, public :: set_up
      procedure, public :: apply
      procedure, public :: dismiss
   end type multigrid_t

   integer, parameter :: neighbours = 27 !< nodes that share an element with a node, itself too

contains

   !> Collective: create an empty matrix for a number of nodes on this rank; PETSc must be initialised.
   subroutine begin(self, comm, nodes)
      class(multigrid_t), intent(inout) :: self
      integer, intent(in) :: comm, nodes
      PetscErrorCode :: ierr
      PetscInt :: n, m
      call self%dismiss()
      n = 3*nodes
      m = 3*neighbours
      PetscCallA(MatCreate(comm, self%matrix, ierr))
      PetscCallA(MatSetSizes(self%matrix, n, n, PETSC_DETERMINE, PETSC_DETERMINE, ierr))
      PetscCallA(MatSetBlockSize(self%matrix, 3, ierr))
      PetscCallA(MatSetType(self%matrix, MATAIJ, ierr))
      PetscCallA(MatSeqAIJSetPreallocation(self%matrix, m, NO_COUNTS, ierr))
      PetscCallA(MatMPIAIJSetPreallocation(self%matrix, m, NO_COUNTS, m, NO_COUNTS, ierr))
      PetscCallA(MatSetOption(self%matrix, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE, ierr))
      PetscCallA(MatSetOption(self%matrix, MAT_SYMMETRIC, PETSC_TRUE, ierr))
      self%made = .true.
   end subroutine begin

   !> Add a matrix to rows and columns of all ranks, from 0; negative ones are skipped.
   subroutine add(self, rows, values)
      class(multigrid_t), intent(inout) :: self
      integer, intent(in) :: rows(:)
      real(wp), intent(in) :: values(:, :) !< symmetric
      PetscErrorCode :: ierr
      PetscInt :: n, at(size(rows))
      PetscScalar :: list(size(values))
      n = size(rows)
      at = rows
      list = reshape(values, [size(values)])
      PetscCallA(MatSetValues(self%matrix, n, at, n, at, list, ADD_VALUES, ierr))
   end subroutine add

   !> Collective: finish the matrix after all additions; nodes are at `places`.
   subroutine set_up(self, comm, places)
      class(multigrid_t), intent(inout) :: self
      integer, intent(in) :: comm
      real(wp), intent(in) :: places(:, :) !< (3, nodes of this rank)
      PetscErrorCode :: ierr
      PetscScalar, pointer :: values(:)
      MatNullSpace :: motions
      Vec :: coordinates
      PetscInt :: n
      PetscCallA(MatAssemblyBegin(self%matrix, MAT_FINAL_ASSEMBLY, ierr))
      PetscCallA(MatAssemblyEnd(self%matrix, MAT_FINAL_ASSEMBLY, ierr))
      PetscCallA(MatCreateVecs(self%matrix, self%from, self%to, ierr))
      n = size(places)
      PetscCallA(VecCreate(comm, coordinates, ierr))
      PetscCallA(VecSetSizes(coordinates, n, PETSC_DETERMINE, ierr))
      PetscCallA(VecSetBlockSize(coordinates, 3, ierr))
      PetscCallA(VecSetType(coordinates, VECSTANDARD, ierr))
      PetscCallA(VecGetArrayF90(coordinates, values, ierr))
      values = reshape(places, [size(places)])
      PetscCallA(VecRestoreArrayF90(coordinates, values, ierr))
      PetscCallA(MatNullSpaceCreateRigidBody(coordinates, motions, ierr))
      PetscCallA(MatSetNearNullSpace(self%matrix, motions, ierr))
      PetscCallA(MatNullSpaceDestroy(motions, ierr))
      PetscCallA(VecDestroy(coordinates, ierr))
      PetscCallA(PCCreate(comm, self%cycle, ierr))
      PetscCallA(PCSetOptionsPrefix(self%cycle, 'quasi_static_multigrid_', ierr))
      PetscCallA(PCSetType(self%cycle, PCGAMG, ierr))
      PetscCallA(PCSetOperators(self%cycle, self%matrix, self%matrix, ierr))
      PetscCallA(PCSetFromOptions(self%cycle, ierr))
      PetscCallA(PCSetUp(self%cycle, ierr))
   end subroutine set_up

   !> Collective: one cycle, from 0.
   subroutine apply(self, from, to)
      class(multigrid_t), intent(inout) :: self
      real(wp), intent(in) :: from(:)
      real(wp), intent(out) :: to(:)
      PetscErrorCode :: ierr
      PetscScalar, pointer :: values(:)
      PetscCallA(VecGetArrayF90(self%from, values, ierr))
      values = from
      PetscCallA(VecRestoreArrayF90(self%from, values, ierr))
      PetscCallA(PCApply(self%cycle, self%from, self%to, ierr))
      PetscCallA(VecGetArrayReadF90(self%to, values, ierr))
      to = values
      PetscCallA(VecRestoreArrayReadF90(self%to, values, ierr))
   end subroutine apply

   !> Collective: free the objects.
   subroutine dismiss(self)
      class(multigrid_t), intent(inout) :: self
      PetscErrorCode :: ierr
      if (.not. self%made) return
      PetscCallA(PCDestroy(self%cycle, ierr))
      PetscCallA(MatDestroy(self%matrix, ierr))
      PetscCallA(VecDestroy(self%from, ierr))
      PetscCallA(VecDestroy(self%to, ierr))
      self%made = .false.
   end subroutine dismiss

end module m_multigrid
