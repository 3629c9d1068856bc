!> Bodies and tools of a scene as convex regions of space: where they are, and whether two of them overlap.
module m_scene_shapes
   use m_kinds, only: wp
   use m_scene, only: body_spec_t, tool_spec_t, shape_box, shape_sphere, tool_sphere
   use m_tool_shape, only: tool_shape_t, make_tool_shape
   implicit none
   private
   public :: body_extent, body_distance, bodies_overlap, tool_overlaps

   integer, parameter :: narrowings = 40 !< golden-section steps along each axis: 4e-9 of the width
   real(wp), parameter :: golden = 0.61803398874989485_wp

   !> Two regions, the second a body or a tool.
   type :: pair_t
      type(body_spec_t) :: body
      type(body_spec_t) :: other
      type(tool_shape_t) :: tool
      real(wp) :: tip(3) = 0.0_wp !< of the tool, m
      logical :: with_tool = .false.
   end type pair_t

contains

   !> Corners of the smallest box along the axes that holds a body.
   pure subroutine body_extent(body, lower, upper)
      type(body_spec_t), intent(in) :: body
      real(wp), intent(out) :: lower(3), upper(3)
      real(wp) :: disc(3), top(3)
      select case (body%shape)
      case (shape_box)
         lower = body%lower
         upper = body%upper
      case (shape_sphere)
         lower = body%center - body%radius
         upper = body%center + body%radius
      case default
         disc = body%radius*sqrt(max(1.0_wp - body%axis**2, 0.0_wp))
         top = body%center + body%height*body%axis
         lower = min(body%center, top) - disc
         upper = max(body%center, top) + disc
      end select
   end subroutine body_extent

   !> Signed distance of a point from the surface of a body, negative inside; a convex function of the point.
   pure real(wp) function body_distance(body, point) result(distance)
      type(body_spec_t), intent(in) :: body
      real(wp), intent(in) :: point(3)
      real(wp) :: along, across
      select case (body%shape)
      case (shape_box)
         distance = outside(abs(point - 0.5_wp*(body%lower + body%upper)) - 0.5_wp*(body%upper - body%lower))
      case (shape_sphere)
         distance = norm2(point - body%center) - body%radius
      case default
         along = dot_product(point - body%center, body%axis)
         across = norm2(point - body%center - along*body%axis)
         distance = outside([across - body%radius, abs(along - 0.5_wp*body%height) - 0.5_wp*body%height])
      end select
   end function body_distance

   !> Signed distance from an intersection of slabs, from the signed distances to each.
   pure real(wp) function outside(excess)
      real(wp), intent(in) :: excess(:)
      outside = norm2(max(excess, 0.0_wp)) + min(maxval(excess), 0.0_wp)
   end function outside

   !> Whether two bodies share more than a layer of thickness `tolerance`.
   logical function bodies_overlap(a, b, tolerance) result(overlap)
      type(body_spec_t), intent(in) :: a, b
      real(wp), intent(in) :: tolerance
      type(pair_t) :: pair
      real(wp) :: lower(3), upper(3), lower_b(3), upper_b(3)
      call body_extent(a, lower, upper)
      call body_extent(b, lower_b, upper_b)
      lower = max(lower, lower_b)
      upper = min(upper, upper_b)
      overlap = all(upper - lower > tolerance)
      if (.not. overlap .or. (a%shape == shape_box .and. b%shape == shape_box)) return
      if (a%shape == shape_sphere .and. b%shape == shape_sphere) then
         overlap = a%radius + b%radius - norm2(a%center - b%center) > tolerance
         return
      end if
      pair%body = a
      pair%other = b
      overlap = deepest(pair, lower, upper, -0.5_wp*tolerance) < -0.5_wp*tolerance
   end function bodies_overlap

   !> Whether a tool where it starts shares more than a layer of thickness `tolerance` with a body.
   logical function tool_overlaps(tool, body, tolerance) result(overlap)
      type(tool_spec_t), intent(in) :: tool
      type(body_spec_t), intent(in) :: body
      real(wp), intent(in) :: tolerance
      type(pair_t) :: pair
      real(wp) :: lower(3), upper(3), centre(3)
      call body_extent(body, lower, upper)
      if (tool%shape == tool_sphere) then
         centre = tool%tip - tool%radius*tool%axis
         lower = max(lower, centre - tool%radius)
         upper = min(upper, centre + tool%radius)
      end if
      overlap = all(upper - lower > tolerance)
      if (.not. overlap) return
      pair%body = body
      pair%tool = make_tool_shape(tool)
      pair%tip = tool%tip
      pair%with_tool = .true.
      overlap = deepest(pair, lower, upper, -0.5_wp*tolerance) < -0.5_wp*tolerance
   end function tool_overlaps

   !> The smallest value in a box of the larger of the two signed distances: below 0 where the regions overlap. As that function
   !> is convex, so is its minimum along one axis as a function of the other two: three nested searches find it. Stops as soon as
   !> a value is below `enough`.
   real(wp) function deepest(pair, lower, upper, enough)
      type(pair_t), intent(in) :: pair
      real(wp), intent(in) :: lower(3), upper(3), enough
      real(wp) :: point(3)
      point = 0.5_wp*(lower + upper)
      deepest = lowest(pair, lower, upper, point, 1, enough)
   end function deepest

   !> The smallest value along axes axis..3 through a point (golden section).
   recursive real(wp) function lowest(pair, lower, upper, point, axis, enough) result(best)
      type(pair_t), intent(in) :: pair
      real(wp), intent(in) :: lower(3), upper(3), point(3), enough
      integer, intent(in) :: axis
      real(wp) :: x(3), left, right, inner(2), value(2), gap, normal(3)
      integer :: step
      if (axis == 4) then
         best = body_distance(pair%body, point)
         if (pair%with_tool) then
            call pair%tool%gap_and_normal(point - pair%tip, gap, normal)
            best = max(best, gap)
         else
            best = max(best, body_distance(pair%other, point))
         end if
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

end module m_scene_shapes
