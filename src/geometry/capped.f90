!> Bodies shaped as cones and pyramids: the open tool shapes, closed by a plane across their axis.
module m_capped
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_value_range, only: any_value, above
   use m_section, only: section_t
   use m_shape, only: convex_t, why_not_round
   use m_shape_variables, only: make_unit
   use m_cone, only: cone_t
   use m_regular_pyramid, only: regular_pyramid_t
   implicit none
   private
   public :: capped_cone_t, capped_pyramid_t

   type, abstract, extends(convex_t) :: capped_t
      real(wp) :: tip(3) = 0.0_wp !< foremost point, m
      real(wp) :: height = 0.0_wp !< from there to the plane, m
   contains
      procedure :: variables
      procedure :: distance_and_normal
      procedure :: bounding_box
      procedure :: centre
      procedure :: lattice_origin
      procedure :: place_name
      procedure(form_interface), deferred :: form_variables
      procedure(distance_interface), deferred :: form_distance
      procedure(radius_interface), deferred :: form_radius
   end type capped_t

   type, extends(capped_t) :: capped_cone_t
      type(cone_t) :: form
   contains
      procedure :: form_variables => cone_variables
      procedure :: form_distance => cone_distance
      procedure :: form_radius => cone_radius
      procedure :: volume => cone_volume
      procedure :: take_section => cone_section
   end type capped_cone_t

   type, extends(capped_t) :: capped_pyramid_t
      type(regular_pyramid_t) :: form
   contains
      procedure :: form_variables => pyramid_variables
      procedure :: form_distance => pyramid_distance
      procedure :: form_radius => pyramid_radius
      procedure :: volume => pyramid_volume
   end type capped_pyramid_t

   abstract interface
      !> Read the variables of the form, and prepare it.
      subroutine form_interface(self, group)
         import :: capped_t, group_reader_t
         class(capped_t), intent(inout) :: self
         type(group_reader_t), intent(inout) :: group
      end subroutine form_interface
      !> Signed distance of a point given relative to the tip, m.
      pure subroutine distance_interface(self, place, distance, normal)
         import :: capped_t, wp
         class(capped_t), intent(in) :: self
         real(wp), intent(in) :: place(3)
         real(wp), intent(out) :: distance, normal(3)
      end subroutine distance_interface
      !> Upper bound of the distance of the form's points from the axis at the plane, m.
      pure real(wp) function radius_interface(self) result(radius)
         import :: capped_t, wp
         class(capped_t), intent(in) :: self
      end function radius_interface
   end interface

contains

   subroutine variables(self, group)
      class(capped_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('tip', self%tip, any_value('m'), required=.true.)
      call group%get('axis', self%axis, any_value(''))
      call make_unit(group, self%axis)
      call group%get('height', self%height, above(0.0_wp, 'm'), required=.true.)
      call self%form_variables(group)
   end subroutine variables

   !> Inside both the form and the half space before the plane. Near the rim the distance is too small.
   pure subroutine distance_and_normal(self, place, distance, normal)
      class(capped_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: behind
      call self%form_distance(place - self%tip, distance, normal)
      behind = -dot_product(place - self%tip, self%axis) - self%height
      if (behind <= distance) return
      distance = behind
      normal = -self%axis
   end subroutine distance_and_normal

   pure subroutine bounding_box(self, lower, upper)
      class(capped_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      real(wp) :: plane(3), reach(3)
      plane = self%tip - self%height*self%axis
      reach = self%form_radius()*sqrt(max(0.0_wp, 1.0_wp - self%axis**2))
      lower = min(self%tip, plane - reach)
      upper = max(self%tip, plane + reach)
   end subroutine bounding_box

   !> The centre of a sharp cone: a quarter of the height before the plane.
   pure function centre(self)
      class(capped_t), intent(in) :: self
      real(wp) :: centre(3)
      centre = self%tip - 0.75_wp*self%height*self%axis
   end function centre

   pure function lattice_origin(self) result(origin)
      class(capped_t), intent(in) :: self
      real(wp) :: origin(3)
      origin = self%tip
   end function lattice_origin

   pure function place_name(self, down) result(name)
      class(capped_t), intent(in) :: self
      logical, intent(in) :: down
      character(len=:), allocatable :: name
      name = 'tip'
   end function place_name

   subroutine cone_variables(self, group)
      class(capped_cone_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call self%form%variables(group)
      call self%form%prepare(self%axis)
   end subroutine cone_variables

   pure subroutine cone_distance(self, place, distance, normal)
      class(capped_cone_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      call self%form%distance_and_normal(place, distance, normal)
   end subroutine cone_distance

   !> The radius of a sharp cone whose apex is before the tip.
   pure real(wp) function cone_radius(self) result(radius)
      class(capped_cone_t), intent(in) :: self
      radius = (self%height + before(self%form%tip_radius, self%form%half_angle))*tan(self%form%half_angle)
   end function cone_radius

   !> The volume of a sharp cone minus the part rounded off: its tip minus the spherical part.
   pure real(wp) function cone_volume(self) result(volume)
      class(capped_cone_t), intent(in) :: self
      real(wp) :: cap, r
      volume = pi/3.0_wp*self%form_radius()**2 &
               *(self%height + before(self%form%tip_radius, self%form%half_angle))
      r = self%form%tip_radius
      cap = r*(1.0_wp - sin(self%form%half_angle)) ! height of the spherical part, and of the tip before it
      volume = volume - pi/3.0_wp*(r*cos(self%form%half_angle))**2 &
               *(cap + before(r, self%form%half_angle)) + pi/3.0_wp*cap**2*(3.0_wp*r - cap)
   end function cone_volume

   subroutine cone_section(self, section, why)
      class(capped_cone_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_round(section, self%tip, self%axis)
   end subroutine cone_section

   subroutine pyramid_variables(self, group)
      class(capped_pyramid_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      self%form%axis = self%axis
      call self%form%variables(group)
      call self%form%prepare(self%axis)
   end subroutine pyramid_variables

   pure subroutine pyramid_distance(self, place, distance, normal)
      class(capped_pyramid_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      call self%form%distance_and_normal(place, distance, normal)
   end subroutine pyramid_distance

   !> Radius of the corners.
   pure real(wp) function pyramid_radius(self) result(radius)
      class(capped_pyramid_t), intent(in) :: self
      radius = (self%height + before(self%form%tip_radius, self%form%half_angle)) &
               *tan(self%form%half_angle)/cos(pi/max(3, self%form%sides))
   end function pyramid_radius

   !> Volume of a sharp pyramid.
   pure real(wp) function pyramid_volume(self) result(volume)
      class(capped_pyramid_t), intent(in) :: self
      real(wp) :: height
      height = self%height + before(self%form%tip_radius, self%form%half_angle)
      volume = height/3.0_wp*self%form%sides*tan(pi/self%form%sides)*(height*tan(self%form%half_angle))**2
   end function pyramid_volume

   !> Distance of the apex before a rounded tip, m.
   pure real(wp) function before(radius, half_angle)
      real(wp), intent(in) :: radius, half_angle
      before = radius*(1.0_wp/sin(half_angle) - 1.0_wp)
      if (.not. half_angle > 0.0_wp) before = 0.0_wp
   end function before

end module m_capped
