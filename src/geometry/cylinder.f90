!> A cylinder of given height, from the centre of its base along its axis.
module m_cylinder
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_group_reader, only: group_reader_t
   use m_value_range, only: any_value, above
   use m_section, only: section_t
   use m_shape, only: convex_t, why_not_round, why_not_along
   use m_shape_variables, only: make_unit
   implicit none
   private
   public :: cylinder_t

   type, extends(convex_t) :: cylinder_t
      real(wp) :: center(3) = 0.0_wp !< of the base, m
      real(wp) :: radius = 0.0_wp    !< m
      real(wp) :: height = 0.0_wp    !< m
      logical :: endless = .false.   !< unbounded along its axis, in a section across it
   contains
      procedure :: variables
      procedure :: distance_and_normal
      procedure :: bounding_box
      procedure :: inside
      procedure :: volume
      procedure :: area
      procedure :: centre
      procedure :: lattice_origin
      procedure :: thinnest
      procedure :: take_section
   end type cylinder_t

contains

   subroutine variables(self, group)
      class(cylinder_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('center', self%center, any_value('m'), required=.true.)
      call group%get('radius', self%radius, above(0.0_wp, 'm'), required=.true.)
      call group%get('height', self%height, above(0.0_wp, 'm'), required=.true.)
      call group%get('axis', self%axis, any_value(''))
      call make_unit(group, self%axis)
   end subroutine variables

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(cylinder_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: along, across, radial(3), excess(2), share(2)
      along = dot_product(place - self%center, self%axis)
      radial = place - self%center - along*self%axis
      across = norm2(radial)
      if (across > 0.0_wp) radial = radial/across
      excess = [across - self%radius, abs(along - 0.5_wp*self%height) - 0.5_wp*self%height]
      if (self%endless) excess(2) = -huge(1.0_wp)
      distance = norm2(max(excess, 0.0_wp)) + min(maxval(excess), 0.0_wp)
      if (distance > 0.0_wp) then
         share = max(excess, 0.0_wp)/distance
      else
         share = merge([1.0_wp, 0.0_wp], [0.0_wp, 1.0_wp], excess(1) > excess(2) .and. across > 0.0_wp)
      end if
      normal = share(1)*radial + sign(share(2), along - 0.5_wp*self%height)*self%axis
   end subroutine distance_and_normal

   pure subroutine bounding_box(self, lower, upper)
      class(cylinder_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      real(wp) :: reach(3)
      reach = self%radius*sqrt(max(0.0_wp, 1.0_wp - self%axis**2))
      lower = self%center + min(0.0_wp, self%height*self%axis) - reach
      upper = self%center + max(0.0_wp, self%height*self%axis) + reach
   end subroutine bounding_box

   pure logical function inside(self, place)
      class(cylinder_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp) :: along
      along = dot_product(place - self%center, self%axis)
      inside = (self%endless .or. (along > 0.0_wp .and. along < self%height)) &
               .and. sum((place - self%center)**2) - along**2 < self%radius**2
   end function inside

   pure real(wp) function volume(self)
      class(cylinder_t), intent(in) :: self
      volume = pi*self%radius**2*self%height
   end function volume

   pure real(wp) function area(self)
      class(cylinder_t), intent(in) :: self
      area = 2.0_wp*pi*self%radius*(self%radius + self%height)
   end function area

   pure function centre(self)
      class(cylinder_t), intent(in) :: self
      real(wp) :: centre(3)
      centre = self%center + 0.5_wp*self%height*self%axis
   end function centre

   pure function lattice_origin(self) result(origin)
      class(cylinder_t), intent(in) :: self
      real(wp) :: origin(3)
      origin = self%center
   end function lattice_origin

   pure subroutine thinnest(self, thickness, variable)
      class(cylinder_t), intent(in) :: self
      real(wp), intent(out) :: thickness
      character(len=:), allocatable, intent(out) :: variable
      thickness = 2.0_wp*self%radius
      variable = 'radius'
      if (self%endless .or. self%height >= thickness) return
      thickness = self%height
      variable = 'height'
   end subroutine thinnest

   !> A section about the axis, or along y.
   subroutine take_section(self, section, why)
      class(cylinder_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      if (section%is_round()) then
         why = why_not_round(section, self%center, self%axis)
      else
         why = why_not_along(section, self%axis)
         self%endless = .true.
      end if
   end subroutine take_section

end module m_cylinder
