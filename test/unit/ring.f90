!> A shape that is not convex: a ring about its axis, of round section.
module m_ring
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above
   use m_shape, only: shape_t
   use m_vectors, only: split_along, tangents
   implicit none
   private
   public :: ring_t

   type, extends(shape_t) :: ring_t
      real(wp) :: center(3) = 0.0_wp !< m
      real(wp) :: radius = 0.0_wp    !< of the circle in the middle of the section, m
      real(wp) :: tube = 0.0_wp      !< radius of the section, m
   contains
      procedure :: variables
      procedure :: prepare
      procedure :: distance_and_normal
      procedure :: bounding_box
      procedure :: volume
   end type ring_t

contains

   subroutine variables(self, group)
      class(ring_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('radius', self%radius, above(0.0_wp, 'm'), required=.true.)
      call group%get('tube', self%tube, above(0.0_wp, 'm'), required=.true.)
   end subroutine variables

   pure subroutine prepare(self, axis)
      class(ring_t), intent(inout) :: self
      real(wp), intent(in) :: axis(3)
      self%axis = axis
      self%center = -self%tube*axis
   end subroutine prepare

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(ring_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: height, radius, radial(3), across(3, 2)
      call split_along(self%axis, place - self%center, height, radius, radial)
      if (.not. radius > 0.0_wp) then ! all around is as near
         across = tangents(self%axis)
         radial = across(:, 1)
      end if
      normal = (radius - self%radius)*radial - height*self%axis
      distance = norm2(normal)
      if (distance > 0.0_wp) then
         normal = normal/distance
      else
         normal = self%axis
      end if
      distance = distance - self%tube
   end subroutine distance_and_normal

   pure subroutine bounding_box(self, lower, upper)
      class(ring_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      upper = self%radius*sqrt(max(0.0_wp, 1.0_wp - self%axis**2)) + self%tube
      lower = self%center - upper
      upper = self%center + upper
   end subroutine bounding_box

   pure real(wp) function volume(self)
      class(ring_t), intent(in) :: self
      volume = 2.0_wp*pi**2*self%radius*self%tube**2
   end function volume

end module m_ring
