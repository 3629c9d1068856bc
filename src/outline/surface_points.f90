!> Contact points near a tool in projection along its axis, and the search for those near a position.
module m_surface_points
   use m_kinds, only: wp
   implicit none
   private
   public :: surface_point_t, squares_t, sorted_in_squares, find_neighbours, sorted_near

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
      real(wp) :: half(2) = 0.0_wp  !< half the size of its domain in the projection, m
   end type surface_point_t

   !> Places of points, sorted by squares of a cell's width: row by row, and in a square as the points stand.
   type :: squares_t
      real(wp) :: low(2) = 0.0_wp, width = 1.0_wp
      integer :: along(2) = 0              !< numbers of squares
      integer, allocatable :: first(:)     !< (squares + 1): first sorted point of each square
      integer, allocatable :: point(:)     !< (points): number of each sorted point
      real(wp), allocatable :: x(:), y(:)  !< (points): place of each sorted point, m
   end type squares_t

contains

   !> Sort points into squares of a given width.
   pure function sorted_in_squares(points, width) result(squares)
      type(surface_point_t), intent(in) :: points(:)
      real(wp), intent(in) :: width !< m
      type(squares_t) :: squares
      integer :: at(2), n, p, s, square(size(points))
      squares%width = width
      squares%low = [minval(points%place(1)), minval(points%place(2))]
      squares%along = square_of(squares, [maxval(points%place(1)), maxval(points%place(2))]) + 1
      allocate (squares%first(product(squares%along) + 1), source=0)
      allocate (squares%point(size(points)), squares%x(size(points)), squares%y(size(points)))
      do p = 1, size(points)
         at = square_of(squares, points(p)%place)
         square(p) = 1 + at(1) + squares%along(1)*at(2)
         squares%first(square(p)) = squares%first(square(p)) + 1
      end do
      n = 1
      do s = 1, size(squares%first)
         n = n + squares%first(s)
         squares%first(s) = n
      end do
      do p = size(points), 1, -1 ! on the way each first goes from behind the square's points to the first
         n = squares%first(square(p)) - 1
         squares%first(square(p)) = n
         squares%point(n) = p
         squares%x(n) = points(p)%place(1)
         squares%y(n) = points(p)%place(2)
      end do
   end function sorted_in_squares

   pure function square_of(squares, place) result(at)
      type(squares_t), intent(in) :: squares
      real(wp), intent(in) :: place(2)
      integer :: at(2)
      at = floor((place - squares%low)/squares%width)
   end function square_of

   !> The points within a distance of a position: the first `count` of `near`.
   pure subroutine find_neighbours(squares, place, distance, near, count)
      type(squares_t), intent(in) :: squares
      real(wp), intent(in) :: place(2), distance !< m
      integer, intent(inout) :: near(:) !< room for all points
      integer, intent(out) :: count
      integer :: high(2), j, low(2), n
      low = max(0, square_of(squares, place - distance))
      high = min(squares%along - 1, square_of(squares, place + distance))
      count = 0
      if (low(1) > high(1)) return
      do j = low(2), high(2)
         do n = squares%first(1 + low(1) + squares%along(1)*j), &
                squares%first(2 + high(1) + squares%along(1)*j) - 1
            if ((squares%x(n) - place(1))**2 + (squares%y(n) - place(2))**2 > distance**2) cycle
            count = count + 1
            near(count) = squares%point(n)
         end do
      end do
   end subroutine find_neighbours

   !> First and last of the sorted points in the rows of squares that are within a distance of a line.
   pure function sorted_near(squares, from, to, distance) result(range)
      type(squares_t), intent(in) :: squares
      real(wp), intent(in) :: from(2), to(2), distance !< ends of the line; m
      integer :: range(2)
      integer :: high, low
      low = max(0, floor((min(from(2), to(2)) - distance - squares%low(2))/squares%width))
      high = min(squares%along(2) - 1, floor((max(from(2), to(2)) + distance - squares%low(2))/squares%width))
      range = [1, 0]
      if (low <= high) range = [squares%first(1 + squares%along(1)*low), &
                                squares%first(1 + squares%along(1)*(high + 1)) - 1]
   end function sorted_near

end module m_surface_points
