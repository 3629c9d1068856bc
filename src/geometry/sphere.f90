!> A sphere.
module m_sphere
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_value_range, only: any_value, above
   use m_section, only: section_t
   use m_shape, only: convex_t, why_not_round
   implicit none
   private
   public :: sphere_t, round

   type, extends(convex_t) :: sphere_t
      real(wp) :: center(3) = 0.0_wp !< m
      real(wp) :: radius = 0.0_wp    !< m
   contains
      procedure :: variables
      procedure :: prepare
      procedure :: distance_and_normal
      procedure :: bounding_box
      procedure :: reach
      procedure :: inside
      procedure :: volume
      procedure :: area
      procedure :: centre
      procedure :: thinnest
      procedure :: take_section
   end type sphere_t

contains

   subroutine variables(self, group)
      class(sphere_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      if (.not. self%of_tool) call group%get('center', self%center, any_value('m'), required=.true.)
      call group%get('radius', self%radius, above(0.0_wp, 'm'), required=.true.)
   end subroutine variables

   pure subroutine prepare(self, axis)
      class(sphere_t), intent(inout) :: self
      real(wp), intent(in) :: axis(3)
      self%axis = axis
      self%center = -self%radius*axis
   end subroutine prepare

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(sphere_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      call round(place - self%center, self%radius, self%axis, distance, normal)
   end subroutine distance_and_normal

   !> Distance and normal for a sphere or a cylinder, from the vector from its centre or centre line; at the
   !> centre the normal is the axis.
   pure subroutine round(from_centre, radius, axis, distance, normal)
      real(wp), intent(in) :: from_centre(3), radius, axis(3)
      real(wp), intent(out) :: distance, normal(3)
      normal = from_centre
      distance = norm2(normal)
      if (distance > 0.0_wp) then
         normal = normal/distance
      else
         normal = axis
      end if
      distance = distance - radius
   end subroutine round

   pure subroutine bounding_box(self, lower, upper)
      class(sphere_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      lower = self%center - self%radius
      upper = self%center + self%radius
   end subroutine bounding_box

   pure real(wp) function reach(self, place, axis)
      class(sphere_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(in), optional :: axis(3)
      real(wp) :: way(3)
      way = self%center - place
      if (present(axis)) way = way - dot_product(way, axis)*axis
      reach = norm2(way) + self%radius
   end function reach

   pure logical function inside(self, place)
      class(sphere_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      inside = sum((place - self%center)**2) < self%radius**2
   end function inside

   pure real(wp) function volume(self)
      class(sphere_t), intent(in) :: self
      volume = 4.0_wp/3.0_wp*pi*self%radius**3
   end function volume

   pure real(wp) function area(self)
      class(sphere_t), intent(in) :: self
      area = 4.0_wp*pi*self%radius**2
   end function area

   pure function centre(self)
      class(sphere_t), intent(in) :: self
      real(wp) :: centre(3)
      centre = self%center
   end function centre

   pure subroutine thinnest(self, thickness, variable)
      class(sphere_t), intent(in) :: self
      real(wp), intent(out) :: thickness
      character(len=:), allocatable, intent(out) :: variable
      thickness = 2.0_wp*self%radius
      variable = 'radius'
   end subroutine thinnest

   subroutine take_section(self, section, why)
      class(sphere_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_round(section, merge(0.0_wp, self%center, self%of_tool))
   end subroutine take_section

end module m_sphere
