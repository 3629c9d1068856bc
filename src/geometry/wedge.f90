!> A wedge, open upwards.
module m_wedge
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_pyramid, only: pyramid_t
   use m_section, only: section_t
   use m_shape, only: why_not_along
   use m_shape_variables, only: get_half_angle, get_edge
   use m_vectors, only: part_across
   implicit none
   private
   public :: wedge_t

   !> Two faces, whose ridge is along `edge`.
   type, extends(pyramid_t) :: wedge_t
   contains
      procedure :: variables
      procedure :: outwards
      procedure :: take_section
   end type wedge_t

contains

   subroutine variables(self, group)
      class(wedge_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call get_half_angle(group, self%half_angle)
      call get_edge(group, self%axis, self%edge)
   end subroutine variables

   pure function outwards(self, edge, across) result(ways)
      class(wedge_t), intent(in) :: self
      real(wp), intent(in) :: edge(3), across(3)
      real(wp), allocatable :: ways(:, :)
      ways = reshape([across, -across], [3, 2])
   end function outwards

   subroutine take_section(self, section, why)
      class(wedge_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_along(section, part_across(self%edge, self%axis))
   end subroutine take_section

end module m_wedge
