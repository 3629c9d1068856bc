!> A box along the grid, given by two corners.
module m_box
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_number_text, only: reals_text
   use m_value_range, only: any_value
   use m_section, only: section_t
   use m_shape, only: convex_t
   implicit none
   private
   public :: box_t

   type, extends(convex_t) :: box_t
      real(wp) :: lower(3) = 0.0_wp !< m
      real(wp) :: upper(3) = 0.0_wp !< m
      logical :: endless = .false.  !< unbounded along y, in a section
      logical :: ring = .false.     !< ring around the axis x = y = 0
   contains
      procedure :: variables
      procedure :: distance_and_normal
      procedure :: bounding_box
      procedure :: inside
      procedure :: lattice_origin
      procedure :: is_lattice
      procedure :: thinnest
      procedure :: place_name
      procedure :: take_section
   end type box_t

contains

   subroutine variables(self, group)
      class(box_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      call group%get('lower', self%lower, any_value('m'), required=.true.)
      call group%get('upper', self%upper, any_value('m'), required=.true.)
      if (any(self%upper <= self%lower)) &
         call group%refuse('upper', 'must be above lower='//reals_text(self%lower)//' in every direction')
   end subroutine variables

   pure subroutine distance_and_normal(self, place, distance, normal)
      class(box_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: from_centre(3), excess(3), radius
      from_centre = place - 0.5_wp*(self%lower + self%upper)
      radius = hypot(place(1), place(2))
      if (self%ring) from_centre(1) = radius - 0.5_wp*(self%lower(1) + self%upper(1))
      excess = abs(from_centre) - 0.5_wp*(self%upper - self%lower)
      if (self%endless) excess(2) = -huge(1.0_wp)
      distance = norm2(max(excess, 0.0_wp)) + min(maxval(excess), 0.0_wp)
      if (distance > 0.0_wp) then
         normal = max(excess, 0.0_wp)/distance
      else
         normal = 0.0_wp
         normal(maxloc(excess, dim=1)) = 1.0_wp
      end if
      normal = sign(normal, from_centre)
      if (self%ring .and. radius > 0.0_wp) normal(:2) = normal(1)/radius*place(:2)
   end subroutine distance_and_normal

   pure subroutine bounding_box(self, lower, upper)
      class(box_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      lower = self%lower
      upper = self%upper
   end subroutine bounding_box

   pure logical function inside(self, place)
      class(box_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      inside = all((place > self%lower .and. place < self%upper) .or. [.false., self%endless, .false.])
   end function inside

   pure function lattice_origin(self) result(origin)
      class(box_t), intent(in) :: self
      real(wp) :: origin(3)
      origin = self%lower
   end function lattice_origin

   pure logical function is_lattice(self)
      class(box_t), intent(in) :: self
      is_lattice = .true.
   end function is_lattice

   pure subroutine thinnest(self, thickness, variable)
      class(box_t), intent(in) :: self
      real(wp), intent(out) :: thickness
      character(len=:), allocatable, intent(out) :: variable
      thickness = minval(self%upper - self%lower, mask=[.true., .not. self%endless, .true.])
      variable = 'upper'
   end subroutine thinnest

   !> The section of a ring, or of a bar along y. The scene's extents along y are ignored.
   subroutine take_section(self, section, why)
      class(box_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = ''
      if (section%is_round() .and. self%lower(1) < 0.0_wp) why = 'must not reach below x=0, the axis'
      self%endless = .true.
      self%ring = section%is_round()
   end subroutine take_section

   pure function place_name(self, down) result(name)
      class(box_t), intent(in) :: self
      logical, intent(in) :: down
      character(len=:), allocatable :: name
      name = merge('lower', 'upper', down)
   end function place_name

end module m_box
