!> What the solver needs of an operator, free of PETSc.
module m_petsc_operator
   use m_kinds, only: wp
   implicit none
   private
   public :: petsc_operator_t

   !> A symmetric positive semi-definite operator, distributed like its vectors.
   type, abstract :: petsc_operator_t
   contains
      procedure(multiply_interface), deferred :: multiply
   end type petsc_operator_t

   abstract interface
      !> Collective: to = M from; both may be longer than the unknowns in use, the rest is copied.
      subroutine multiply_interface(self, from, to)
         import :: petsc_operator_t, wp
         class(petsc_operator_t), intent(inout) :: self
         real(wp), intent(in) :: from(:)
         real(wp), intent(out) :: to(:)
      end subroutine multiply_interface
   end interface

end module m_petsc_operator
