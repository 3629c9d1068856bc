!> Heights as a list of lines `x y z`, one for each point of a grid along x and y, in any order; optionally
!> with column names and units.
module m_height_places
   use m_kinds, only: wp, i8
   use m_column_names, only: columns_t
   use m_height_map, only: height_map_t, row_at_bottom
   use m_length_units, only: length_unit, units_of_length
   use m_sorting, only: sorted_order
   use m_text, only: to_text
   use m_text_lines, only: rows_t
   implicit none
   private
   public :: take_places, take_named

   integer, parameter :: min_places = 4
   real(wp), parameter :: same_place = 1.0e-6_wp !< of the extent: tolerance for rounded numbers
   real(wp), parameter :: jitter = 0.2_wp        !< of the grid spacing: tolerance for the drift of scanners
   real(wp), parameter :: uneven = 0.1_wp        !< of the grid spacing: tolerance between neighbours

contains

   !> Keep only the named columns x, y and z, converted by their units; they must then be a list of points.
   subroutine take_named(columns, rows, map, fault)
      type(columns_t), intent(in) :: columns
      type(rows_t), intent(inout) :: rows
      type(height_map_t), intent(inout) :: map
      character(len=:), allocatable, intent(inout) :: fault
      integer :: at(3), n, width
      real(wp) :: factor(3)
      logical :: is_list
      at = [columns%find([character(len=8) :: 'x', 'posx', 'xpos', 'xcoord', 'position', 'points0']), &
            columns%find([character(len=8) :: 'y', 'posy', 'ypos', 'ycoord', 'points1']), &
            columns%find([character(len=10) :: 'z', 'height', 'heights', 'h', 'topography', 'zheight', &
                          'zcoord', 'points2', 'elevation', 'value'])]
      if (any(at == 0)) then
         fault = columns%sentence('x, y, and z or height; without names a line a row of heights')
         return
      end if
      width = size(columns%name)
      n = findloc(rows%width /= width, .true., dim=1)
      if (n > 0) then
         fault = 'line '//to_text(rows%line(n))//': has '//to_text(rows%width(n))//' numbers, and line '// &
                 to_text(columns%line)//' names '//to_text(width)//' columns'
         return
      end if
      do n = 1, 3
         factor(n) = length_unit(trim(columns%unit(at(n))))
         if (factor(n) > 0.0_wp .or. columns%unit(at(n)) == '') cycle
         fault = columns%sentence(units_of_length//' as units of x, y and heights')
         return
      end do
      if (factor(1) > 0.0_wp .neqv. factor(2) > 0.0_wp) factor(1:2) = maxval(factor(1:2))
      map%spacing_in_m = factor(1) > 0.0_wp
      map%scale = factor(3)
      where (factor <= 0.0_wp .or. [.false., .false., .true.]) factor = 1.0_wp
      associate (count => size(rows%width))
         rows%value = [(factor*rows%value((n - 1)*width + at), n=1, count)]
         rows%width = [(3, n=1, count)]
      end associate
      call take_places(rows, map, is_list, fault)
      if (.not. is_list) fault = 'names columns of places and heights, but x and y are no places of a '// &
                                 'complete grid; allowed: a line for each place of a grid along x and y, once'
   end subroutine take_named

   !> `is_list`: three columns of which the first two are the points of a grid, at least half of them, each
   !> once. Then `map` is the grid, or `fault` a message on what is missing.
   subroutine take_places(rows, map, is_list, fault)
      type(rows_t), intent(in) :: rows
      type(height_map_t), intent(inout) :: map
      logical, intent(out) :: is_list
      character(len=:), allocatable, intent(inout) :: fault
      real(wp), allocatable :: x(:), y(:)
      integer, allocatable :: i(:), j(:)
      integer :: n, missing
      logical, allocatable :: taken(:, :)
      is_list = .false.
      n = size(rows%width)
      if (n < min_places) return
      if (any(rows%width /= 3)) return
      call find_axis(rows%value(1::3), x, i)
      if (size(x) < 2 .or. size(x) > n/2) return
      call find_axis(rows%value(2::3), y, j)
      if (size(y) < 2 .or. size(y) > n/2) return
      if (real(size(x), wp)*size(y) > 2.0_wp*n) return
      allocate (taken(size(x), size(y)), source=.false.)
      allocate (map%height(size(x), size(y)), source=0.0_wp)
      do n = 1, size(i)
         if (taken(i(n), j(n))) return
         taken(i(n), j(n)) = .true.
         map%height(i(n), j(n)) = rows%value(3*n)
      end do
      is_list = .true.
      missing = count(.not. taken)
      map%spacing = [(x(size(x)) - x(1))/(size(x) - 1), (y(size(y)) - y(1))/(size(y) - 1)]
      map%first_row = row_at_bottom
      if (missing > 0) then
         fault = 'holds lines x y z, but '//to_text(missing)//' of the '//to_text(size(taken))// &
                 ' places of their grid, '//to_text(size(x))//' along x by '//to_text(size(y))// &
                 ' along y, are missing; allowed: one for each place'
      else if (.not. (is_even(x) .and. is_even(y))) then
         fault = 'holds lines x y z whose places are not evenly spaced; allowed: a regular grid'
      end if
   end subroutine take_places

   !> The distinct coordinates along an axis, rising, and the index of each value: first within rounding,
   !> then, if that gives no grid, within the drift of a scanner.
   subroutine find_axis(value, place, number)
      real(wp), intent(in) :: value(:)
      real(wp), allocatable, intent(out) :: place(:)
      integer, allocatable, intent(out) :: number(:)
      real(wp), allocatable :: sorted(:)
      real(wp) :: extent, gap
      integer :: pass, n, k, first
      allocate (number(size(value)))
      sorted = sorted_values(value)
      n = size(value)
      extent = sorted(n) - sorted(1)
      do pass = 1, 2
         gap = merge(same_place*extent, jitter*extent/max(1.0_wp, sqrt(real(n, wp))), pass == 1)
         place = [real(wp) ::]
         first = 1
         do k = 1, n
            if (k < n) then
               if (sorted(k + 1) - sorted(k) <= gap) cycle
            end if
            place = [place, sum(sorted(first:k))/(k - first + 1)]
            first = k + 1
            if (size(place) > n/2) exit
         end do
         if (size(place) <= n/2) exit
      end do
      if (size(place) > n/2) return
      do k = 1, n
         number(k) = nearest(place, value(k))
      end do
   end subroutine find_axis

   pure logical function is_even(place)
      real(wp), intent(in) :: place(:)
      real(wp) :: step
      integer :: n
      n = size(place)
      step = (place(n) - place(1))/(n - 1)
      is_even = all(abs(place(2:) - place(:n - 1) - step) <= uneven*step)
   end function is_even

   !> Index of the nearest entry of a rising list.
   pure integer function nearest(place, value) result(low)
      real(wp), intent(in) :: place(:), value
      integer :: high, middle
      low = 1
      high = size(place)
      do while (high - low > 1)
         middle = (low + high)/2
         if (place(middle) <= value) then
            low = middle
         else
            high = middle
         end if
      end do
      if (abs(place(high) - value) < abs(place(low) - value)) low = high
   end function nearest

   !> Values in rising order.
   function sorted_values(list) result(sorted)
      real(wp), intent(in) :: list(:)
      real(wp), allocatable :: sorted(:)
      integer(i8), allocatable :: key(:)
      key = transfer(list, [0_i8])
      where (key < 0) key = ieor(key, huge(0_i8)) ! integers in the order of the numbers
      sorted = list(sorted_order(key, key))
   end function sorted_values

end module m_height_places
