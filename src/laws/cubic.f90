!> Elasticity of cubic symmetry, with axes that rotate with the material (theory.md, eq. cubic).
module m_cubic
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_lattice, only: lattice_t
   use m_value_range, only: above, any_value
   implicit none
   private
   public :: cubic_t

   type, extends(lattice_t) :: cubic_t
      real(wp) :: c11 = 0.0_wp, c12 = 0.0_wp, c44 = 0.0_wp !< Pa
   contains
      procedure :: variables => cubic_variables
      procedure, non_overridable :: cubic_variables
   end type cubic_t

contains

   !> The three moduli. A law with variables of its own calls this first.
   subroutine cubic_variables(self, group)
      class(cubic_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: stiffness(6, 6)
      integer :: i
      call group%get('c11', self%c11, above(0.0_wp, 'Pa'), required=.true.)
      call group%get('c12', self%c12, any_value('Pa'), required=.true.)
      call group%get('c44', self%c44, above(0.0_wp, 'Pa'), required=.true.)
      stiffness = 0.0_wp
      stiffness(:3, :3) = self%c12
      do i = 1, 3
         stiffness(i, i) = self%c11
         stiffness(i + 3, i + 3) = self%c44
      end do
      call self%set_stiffness(group, 'c12', stiffness)
   end subroutine cubic_variables

end module m_cubic
