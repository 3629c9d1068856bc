!> An unbounded cylinder that lies across the axis of a tool.
module m_roller
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_section, only: section_t
   use m_shape, only: convex_t, why_not_along
   use m_shape_variables, only: get_edge
   use m_sphere, only: round
   use m_value_range, only: above
   use m_vectors, only: cross, part_across
   implicit none
   private
   public :: roller_t

   type, extends(convex_t) :: roller_t
      real(wp) :: radius = 0.0_wp                      !< m
      real(wp) :: edge(3) = [1.0_wp, 0.0_wp, 0.0_wp] !< its component normal to the axis is the direction of
                                                     !< the centre line
      real(wp), private :: along(3) = 0.0_wp           !< that direction, a unit vector
   contains
      procedure :: variables
      procedure :: prepare
      procedure :: distance_and_normal
      procedure :: reach
      procedure :: take_section
   end type roller_t

   real(wp), parameter :: parallel = 1.0e-9_wp !< an axis that differs by less from the centre line's
                                               !< direction is parallel to it

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

   !> Known only for axes along the centre line, since the cylinder is unbounded.
   pure real(wp) function reach(self, place, axis)
      class(roller_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(in), optional :: axis(3)
      real(wp) :: way(3)
      reach = huge(1.0_wp)
      if (.not. present(axis)) return
      if (norm2(cross(axis, self%along)) > parallel) return
      way = -self%radius*self%axis - place
      reach = norm2(way - dot_product(way, axis)*axis) + self%radius
   end function reach

   subroutine take_section(self, section, why)
      class(roller_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_along(section, part_across(self%edge, self%axis))
   end subroutine take_section

end module m_roller
