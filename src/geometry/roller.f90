!> A cylinder without ends that lies across the axis of a tool.
module m_roller
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_shape, only: convex_t
   use m_shape_variables, only: get_edge
   use m_sphere, only: round
   use m_value_range, only: above
   use m_vectors, only: part_across
   implicit none
   private
   public :: roller_t

   type, extends(convex_t) :: roller_t
      real(wp) :: radius = 0.0_wp                      !< m
      real(wp) :: edge(3) = [1.0_wp, 0.0_wp, 0.0_wp] !< its part across the axis is the direction of the
                                                     !< centre line
      real(wp), private :: along(3) = 0.0_wp           !< that direction, a unit vector
   contains
      procedure :: variables
      procedure :: prepare
      procedure :: distance_and_normal
   end type roller_t

contains

   subroutine variables(self, group)
      class(roller_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('radius', self%radius, above(0.0_wp, 'm'), required=.true.)
      call get_edge(group, self%axis, self%edge)
   end subroutine variables

   pure subroutine prepare(self, axis)
      class(roller_t), intent(inout) :: self
      real(wp), intent(in) :: axis(3)
      self%axis = axis
      self%along = part_across(self%edge, axis)
   end subroutine prepare

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(roller_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      call round(place - dot_product(place, self%along)*self%along + self%radius*self%axis, self%radius, &
                 self%axis, distance, normal)
   end subroutine distance_and_normal

end module m_roller
