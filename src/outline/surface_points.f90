!> Contact points near a tool in projection along its axis, and the search for those near a position.
module m_surface_points
   use m_kinds, only: wp
   implicit none
   private
   public :: surface_point_t, squares_t, sorted_in_squares, find_neighbours

   !> A contact point near the tool, in projection along its axis: reals only, so that it can be sent.
   type :: surface_point_t
      sequence
      real(wp) :: place(2) = 0.0_wp !< in the projection, m
      real(wp) :: gap = 0.0_wp      !< m
      real(wp) :: edge = 0.0_wp     !< of its particle, m
      real(wp) :: pressed = 0.0_wp  !< 1: pressed by the tool, now or in the last step; else 0
      real(wp) :: beside = 0.0_wp   !< distance beside the tool, so that no part of the tool is above it, m
      real(wp) :: slope(2) = 0.0_wp !< direction of the tool's normal in the projection; 0 on the axis
      real(wp) :: pressure = 0.0_wp !< stress of its particle along that normal, Pa
      real(wp) :: outwards(2) = 0.0_wp !< direction in the projection away from the tool
      real(wp) :: traction = 0.0_wp !< pressure of the tool on it, Pa
      real(wp) :: modulus = 0.0_wp  !< of the half-space, if the compliance below cells is included, so that
                                    !< single pressures are accurate, Pa; else 0
   end type surface_point_t

   !> Points sorted by squares of a cell's width.
   type :: squares_t
      real(wp) :: low(2) = 0.0_wp, width = 1.0_wp
      integer, allocatable :: first(:, :), next(:)
   end type squares_t

contains

   !> Sort points into squares of a given width.
   pure function sorted_in_squares(points, width) result(squares)
      type(surface_point_t), intent(in) :: points(:)
      real(wp), intent(in) :: width !< m
      type(squares_t) :: squares
      integer :: at(2), p
      squares%width = width
      squares%low = [minval(points%place(1)), minval(points%place(2))]
      at = square_of(squares, [maxval(points%place(1)), maxval(points%place(2))])
      allocate (squares%first(0:at(1), 0:at(2)), source=0)
      allocate (squares%next(size(points)))
      do p = size(points), 1, -1
         at = square_of(squares, points(p)%place)
         squares%next(p) = squares%first(at(1), at(2))
         squares%first(at(1), at(2)) = p
      end do
   end function sorted_in_squares

   pure function square_of(squares, place) result(at)
      type(squares_t), intent(in) :: squares
      real(wp), intent(in) :: place(2)
      integer :: at(2)
      at = floor((place - squares%low)/squares%width)
   end function square_of

   !> The points within a distance of a position: the first `count` of `near`. No allocation, as this is
   !> called for every small square of the area.
   pure subroutine find_neighbours(points, squares, place, distance, near, count)
      type(surface_point_t), intent(in) :: points(:)
      type(squares_t), intent(in) :: squares
      real(wp), intent(in) :: place(2), distance !< m
      integer, intent(inout) :: near(:) !< room for all points
      integer, intent(out) :: count
      integer :: i, j, low(2), high(2), p
      low = max(0, square_of(squares, place - distance))
      high = min(ubound(squares%first), square_of(squares, place + distance))
      count = 0
      do j = low(2), high(2)
         do i = low(1), high(1)
            p = squares%first(i, j)
            do while (p > 0)
               if (sum((points(p)%place - place)**2) <= distance**2) then
                  count = count + 1
                  near(count) = p
               end if
               p = squares%next(p)
            end do
         end do
      end do
   end subroutine find_neighbours

end module m_surface_points
