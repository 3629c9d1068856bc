!> A cylinder with a flat end in the origin, open upwards.
module m_flat
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_section, only: section_t
   use m_shape, only: convex_t, why_not_round
   use m_value_range, only: above
   use m_vectors, only: split_along
   implicit none
   private
   public :: flat_t

   type, extends(convex_t) :: flat_t
      real(wp) :: radius = 0.0_wp !< m
   contains
      procedure :: variables
      procedure :: distance_and_normal
      procedure :: take_section
      procedure :: end_radius
   end type flat_t

contains

   subroutine variables(self, group)
      class(flat_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('radius', self%radius, above(0.0_wp, 'm'), required=.true.)
   end subroutine variables

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(flat_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: height, radius, radial(3), below, beside
      call split_along(self%axis, place, height, radius, radial)
      below = -height
      beside = radius - self%radius
      if (below > 0.0_wp .and. beside > 0.0_wp) then
         distance = norm2([below, beside])
         normal = (below*self%axis + beside*radial)/distance
      else if (below >= beside) then
         distance = below
         normal = self%axis
      else
         distance = beside
         normal = radial
      end if
   end subroutine distance_and_normal

   pure real(wp) function end_radius(self)
      class(flat_t), intent(in) :: self
      end_radius = self%radius
   end function end_radius

   subroutine take_section(self, section, why)
      class(flat_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_round(section, [0.0_wp, 0.0_wp, 0.0_wp], self%axis)
      if (.not. section%is_round()) &
         why = why//'; a plate is shape=''wedge'' with half_angle=89.999, edge=0,1,0'
   end subroutine take_section

end module m_flat
