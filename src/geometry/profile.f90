!> A body of revolution, open upwards, whose radius over the height above its tip is piecewise linear between
!> given points, such as a tip with a measured area function. The last segment extends beyond the last point.
module m_profile
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_section, only: section_t
   use m_shape, only: shape_t, why_not_round
   use m_text, only: to_text
   use m_value_range, only: at_least
   use m_vectors, only: split_along
   implicit none
   private
   public :: profile_t

   type, extends(shape_t) :: profile_t
      real(wp), allocatable :: radii(:)   !< m
      real(wp), allocatable :: heights(:) !< above the tip, m; from 0, rising
   contains
      procedure :: variables
      procedure :: is_convex
      procedure :: distance_and_normal
      procedure :: take_section
      procedure :: end_radius
   end type profile_t

contains

   subroutine variables(self, group)
      class(profile_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      integer :: n
      call group%get_list('heights', self%heights, at_least(0.0_wp, 'm'), required=.true.)
      call group%get_list('radii', self%radii, at_least(0.0_wp, 'm'), required=.true.)
      if (group%is_writing() .or. .not. (allocated(self%heights) .and. allocated(self%radii))) return
      n = size(self%heights)
      if (n < 2) then
         call group%refuse('heights', 'must be two numbers at least')
      else if (self%heights(1) > 0.0_wp) then
         call group%refuse('heights', 'must begin with 0, the tip')
      else if (any(self%heights(2:) <= self%heights(:n - 1))) then
         call group%refuse('heights', 'must rise strictly')
      else if (size(self%radii) /= n) then
         call group%refuse('radii', 'must be as many numbers as heights, '//to_text(n)//'; '// &
                           to_text(size(self%radii))//' given')
      else if (any(self%radii(2:) < self%radii(:n - 1)) .or. self%radii(2) <= 0.0_wp) then
         call group%refuse('radii', 'must not fall, and be above 0 from the second on')
      end if
   end subroutine variables

   !> True where each segment is steeper than the one below it.
   pure logical function is_convex(self)
      class(profile_t), intent(in) :: self
      integer :: n
      n = size(self%heights)
      associate (rise => self%heights(2:) - self%heights(:n - 1), out => self%radii(2:) - self%radii(:n - 1))
         is_convex = all(out(2:)*rise(:n - 2) <= out(:n - 2)*rise(2:))
      end associate
   end function is_convex

   !> In the plane of the axis and the point: the nearest point of the segments. At a corner the normal is
   !> directed to the given point.
   pure subroutine distance_and_normal(self, place, distance, normal)
      class(profile_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: height, radius, radial(3), from(2), line(2), way(2), out(2), along, square, least
      logical :: inside
      integer :: k, n
      call split_along(self%axis, place, height, radius, radial)
      n = size(self%heights)
      least = huge(least)
      inside = .false.
      out = [0.0_wp, -1.0_wp]
      from = 0.0_wp
      do k = 0, n - 1 ! the first segment is the flat end, of zero length for a sharp tip
         line = [self%radii(1), 0.0_wp]
         if (k > 0) then
            line = [self%radii(k + 1) - self%radii(k), self%heights(k + 1) - self%heights(k)]
            from = [self%radii(k), self%heights(k)]
            if (height > from(2) .and. (height <= self%heights(k + 1) .or. k == n - 1)) &
               inside = radius < from(1) + (height - from(2))*line(1)/line(2)
         end if
         square = sum(line**2)
         along = 0.0_wp
         if (square > 0.0_wp) along = max(0.0_wp, dot_product([radius, height] - from, line)/square)
         if (k < n - 1) along = min(along, 1.0_wp)
         way = [radius, height] - from - along*line
         if (sum(way**2) >= least) cycle
         least = sum(way**2)
         out = way
         if (least <= 0.0_wp .and. square > 0.0_wp) out = [line(2), -line(1)]/sqrt(square)
      end do
      distance = sqrt(least)
      if (distance > 0.0_wp) out = out/distance
      if (inside) distance = -distance
      if (inside) out = -out
      normal = out(1)*radial - out(2)*self%axis
      if (radius <= 0.0_wp) normal = self%axis
   end subroutine distance_and_normal

   !> The rim is sharp where the wall beside it is steeper than 45 degrees.
   pure real(wp) function end_radius(self)
      class(profile_t), intent(in) :: self
      end_radius = 0.0_wp
      if (self%heights(2) - self%heights(1) > self%radii(2) - self%radii(1)) end_radius = self%radii(1)
   end function end_radius

   subroutine take_section(self, section, why)
      class(profile_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = why_not_round(section, [0.0_wp, 0.0_wp, 0.0_wp], self%axis)
   end subroutine take_section

end module m_profile
