!> The solver's interface to an operator, independent of PETSc.
module m_petsc_operator
   use m_kinds, only: wp
   implicit none
   private
   public :: petsc_operator_t

   !> A symmetric positive semi-definite operator, distributed like its vectors. Solvers mostly use it between
   !> free unknowns, which they choose from time to time: the other entries are 0.
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

      !> Set the unknowns that multiply_free uses; `free` may be longer than the number in use.
      subroutine set_free_interface(self, free)
         import :: petsc_operator_t
         class(petsc_operator_t), intent(inout) :: self
         logical, intent(in) :: free(:)
      end subroutine set_free_interface
   end interface

end module m_petsc_operator
