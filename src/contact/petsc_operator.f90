!> What the solver needs of an operator, free of PETSc.
module m_petsc_operator
   use m_kinds, only: wp
   implicit none
   private
   public :: petsc_operator_t

   !> A symmetric positive semi-definite operator, distributed like its vectors. Solvers ask most of it
   !> between free unknowns, which they choose now and then: the others are 0 in what it takes and gives.
   type, abstract :: petsc_operator_t
   contains
      procedure(multiply_interface), deferred :: multiply
      procedure(set_free_interface), deferred :: set_free
      procedure(multiply_interface), deferred :: multiply_free
   end type petsc_operator_t

   abstract interface
      !> Collective: to = M from; both may be longer than the unknowns in use, the rest is copied.
      subroutine multiply_interface(self, from, to)
         import :: petsc_operator_t, wp
         class(petsc_operator_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: from(:)
         real(wp), intent(out), contiguous :: to(:)
      end subroutine multiply_interface

      !> From now on multiply_free takes and gives these unknowns; `free` may be longer than those in use.
      subroutine set_free_interface(self, free)
         import :: petsc_operator_t
         class(petsc_operator_t), intent(inout) :: self
         logical, intent(in) :: free(:)
      end subroutine set_free_interface
   end interface

end module m_petsc_operator
