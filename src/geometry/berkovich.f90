!> A three-sided pyramid, open upwards.
module m_berkovich
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_pyramid, only: pyramid_t
   use m_shape_variables, only: get_half_angle, get_edge, get_tip_radius
   implicit none
   private
   public :: berkovich_t

   real(wp), parameter :: usual_angle = 65.27_wp !< degrees

   !> Three faces; the normal of the first leans towards `edge`.
   type, extends(pyramid_t) :: berkovich_t
   contains
      procedure :: variables
      procedure :: outwards
   end type berkovich_t

contains

   subroutine variables(self, group)
      class(berkovich_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      if (.not. self%half_angle > 0.0_wp) self%half_angle = usual_angle*(pi/180.0_wp)
      call get_half_angle(group, self%half_angle)
      call get_edge(group, self%axis, self%edge)
      call get_tip_radius(group, self%tip_radius)
   end subroutine variables

   pure function outwards(self, edge, across) result(ways)
      class(berkovich_t), intent(in) :: self
      real(wp), intent(in) :: edge(3), across(3)
      real(wp), allocatable :: ways(:, :)
      ways = reshape([edge, -0.5_wp*edge + sqrt(0.75_wp)*across, -0.5_wp*edge - sqrt(0.75_wp)*across], [3, 3])
   end function outwards

end module m_berkovich
