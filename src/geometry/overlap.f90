!> Overlap of two shapes.
module m_overlap
   use m_kinds, only: wp
   use m_shape, only: shape_t
   implicit none
   private
   public :: overlap, deepest

   integer, parameter :: narrowings = 40 !< golden-section steps along each axis: 4e-9 of the width
   integer, parameter :: max_checks = 100000
   real(wp), parameter :: finest = 1.0e-3_wp !< of the size of the box in which the bounding boxes overlap
   real(wp), parameter :: golden = 0.61803398874989485_wp

   !> Two shapes and their relative position.
   type :: pair_t
      class(shape_t), pointer :: one => null()
      class(shape_t), pointer :: other => null()
      real(wp) :: place(3) = 0.0_wp !< of the origin of the other one, m
   contains
      procedure :: depth
   end type pair_t

contains

   !> True when two shapes share more than a layer of thickness `thin`; where one of them is not convex, only
   !> overlaps by more than `coarse` are certain to be found.
   logical function overlap(one, other, place, thin, coarse)
      class(shape_t), intent(in), target :: one, other
      real(wp), intent(in) :: place(3)     !< of the origin of the other one, m
      real(wp), intent(in) :: thin, coarse !< m
      type(pair_t) :: pair
      real(wp) :: lower(3), upper(3), lower_other(3), upper_other(3), point(3)
      call one%bounding_box(lower, upper)
      call other%bounding_box(lower_other, upper_other)
      lower = max(lower, lower_other + place)
      upper = min(upper, upper_other + place)
      overlap = all(upper - lower > thin)
      if (.not. overlap .or. (one%is_lattice() .and. other%is_lattice())) return
      pair = pair_t(one, other, place)
      if (one%is_convex() .and. other%is_convex()) then
         point = 0.5_wp*(lower + upper)
         overlap = lowest(pair, lower, upper, point, 1, -0.5_wp*thin) < -0.5_wp*thin
      else
         overlap = reaches(pair, lower, upper, -0.5_wp*thin, 0.5_wp*coarse)
      end if
   end function overlap

   !> Penetration depth of a shape in another, m, and its position: the point in it that is furthest inside
   !> the other. Accurate to a twentieth, or as far as the limit of checks allows.
   subroutine deepest(body, tool, place, where_it_is, deep)
      class(shape_t), intent(in), target :: body, tool
      real(wp), intent(in) :: place(3)              !< of the origin of the tool, m
      real(wp), intent(out) :: where_it_is(3), deep !< m
      real(wp) :: lower(3), upper(3), lower_tool(3), upper_tool(3)
      integer :: checks
      call body%bounding_box(lower, upper)
      call tool%bounding_box(lower_tool, upper_tool)
      lower = max(lower, lower_tool + place)
      upper = min(upper, upper_tool + place)
      deep = 0.0_wp
      where_it_is = 0.5_wp*(lower + upper)
      checks = max_checks
      call search(pair_t(body, tool, place), lower, upper, finest*norm2(upper - lower), &
                where_it_is, deep, checks)
   end subroutine deepest

   !> Search a box for a deeper point, first in the half whose middle is deeper.
   recursive subroutine search(pair, lower, upper, least, where_it_is, deep, checks)
      type(pair_t), intent(in) :: pair
      real(wp), intent(in) :: lower(3), upper(3), least !< least: half size below which a box is not divided,
                                                        !< m
      real(wp), intent(inout) :: where_it_is(3), deep
      integer, intent(inout) :: checks
      real(wp) :: middle(3), in_body, off_tool, reach, nearer(3), further(3)
      integer :: axis
      checks = checks - 1
      middle = 0.5_wp*(lower + upper)
      reach = 0.5_wp*norm2(upper - lower)
      in_body = -pair%one%distance(middle)
      off_tool = pair%other%distance(middle - pair%place)
      if (off_tool <= 0.0_wp .and. in_body > deep) then
         deep = in_body
         where_it_is = middle
      end if
      if (checks <= 0 .or. reach <= least .or. off_tool > reach .or. in_body + reach <= 1.05_wp*deep) return
      axis = maxloc(upper - lower, dim=1)
      nearer = upper
      further = lower
      nearer(axis) = middle(axis)
      further(axis) = middle(axis)
      if (pair%one%distance(0.5_wp*(lower + nearer)) <= pair%one%distance(0.5_wp*(further + upper))) then
         call search(pair, lower, nearer, least, where_it_is, deep, checks)
         call search(pair, further, upper, least, where_it_is, deep, checks)
      else
         call search(pair, further, upper, least, where_it_is, deep, checks)
         call search(pair, lower, nearer, least, where_it_is, deep, checks)
      end if
   end subroutine search

   !> The larger of the two signed distances of a point, m: below 0 where it lies in both shapes.
   pure real(wp) function depth(self, point)
      class(pair_t), intent(in) :: self
      real(wp), intent(in) :: point(3)
      depth = max(self%one%distance(point), self%other%distance(point - self%place))
   end function depth

   !> The smallest value in a box of the larger of the two signed distances. As that function is convex, its
   !> minimum along one axis is a convex function of the other two: three nested searches find it. This one
   !> searches along axes axis..3 through a point (golden section), and stops as soon as a value is below
   !> `enough`.
   recursive real(wp) function lowest(pair, lower, upper, point, axis, enough) result(best)
      type(pair_t), intent(in) :: pair
      real(wp), intent(in) :: lower(3), upper(3), point(3), enough
      integer, intent(in) :: axis
      real(wp) :: x(3), left, right, inner(2), value(2)
      integer :: step
      if (axis == 4) then
         best = pair%depth(point)
         return
      end if
      x = point
      left = lower(axis)
      right = upper(axis)
      inner = [right - golden*(right - left), left + golden*(right - left)]
      x(axis) = inner(1)
      value(1) = lowest(pair, lower, upper, x, axis + 1, enough)
      x(axis) = inner(2)
      value(2) = lowest(pair, lower, upper, x, axis + 1, enough)
      best = minval(value)
      do step = 1, narrowings
         if (best < enough) return
         if (value(1) <= value(2)) then
            right = inner(2)
            inner = [right - golden*(right - left), inner(1)]
            value(2) = value(1)
            x(axis) = inner(1)
            value(1) = lowest(pair, lower, upper, x, axis + 1, enough)
         else
            left = inner(1)
            inner = [inner(2), left + golden*(right - left)]
            value(1) = value(2)
            x(axis) = inner(2)
            value(2) = lowest(pair, lower, upper, x, axis + 1, enough)
         end if
         best = min(best, minval(value))
      end do
   end function lowest

   !> True when the larger of the two signed distances is below `enough` somewhere in a box. It changes by no
   !> more than the distance between two points, so its value in the middle bounds it in the whole box: where
   !> that does not decide, the box is halved, but not where no value can be below -`least`.
   recursive logical function reaches(pair, lower, upper, enough, least) result(found)
      type(pair_t), intent(in) :: pair
      real(wp), intent(in) :: lower(3), upper(3), enough, least
      real(wp) :: middle(3), value, nearer(3), further(3)
      integer :: axis
      middle = 0.5_wp*(lower + upper)
      value = pair%depth(middle)
      found = value < enough
      if (found .or. value - 0.5_wp*norm2(upper - lower) >= -least) return
      axis = maxloc(upper - lower, dim=1)
      nearer = upper
      further = lower
      nearer(axis) = middle(axis)
      further(axis) = middle(axis)
      found = reaches(pair, lower, nearer, enough, least)
      if (.not. found) found = reaches(pair, further, upper, enough, least)
   end function reaches

end module m_overlap
