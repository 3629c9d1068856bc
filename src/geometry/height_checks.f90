!> Heights that cannot be what they were taken for: the unit forgotten, a number that stands for no value, a
!> list of places in the shape of a map.
module m_height_checks
   use m_kinds, only: wp
   use m_text, only: to_text
   implicit none
   private
   public :: doubt_heights

   real(wp), parameter :: steepest = 100.0_wp !< height over width
   real(wp), parameter :: huge_by_any_unit = 1.0e30_wp
   real(wp), parameter :: stand_ins(6) = [-9999.0_wp, -99999.0_wp, -32768.0_wp, -32767.0_wp, 9999.0_wp, &
                                          99999.0_wp]
   integer, parameter :: min_places = 4

contains

   !> What is wrong, as what follows the file's name; empty: nothing.
   subroutine doubt_heights(height, spacing, scale, fault)
      real(wp), intent(in) :: height(:, :) !< (along x, along y), in the file's unit
      real(wp), intent(in) :: spacing(2)   !< m
      real(wp), intent(in) :: scale        !< m, of the file's unit
      character(len=:), allocatable, intent(inout) :: fault
      real(wp) :: width(2), high
      integer :: nx, ny
      call look_for_places(height, nx, ny)
      if (nx > 0) then
         fault = 'holds lines of three numbers whose first two are places, '//to_text(nx)//' along x and '// &
                 to_text(ny)//' along y; allowed: the heights alone, a line for each y'
         return
      end if
      call look_for_stand_in(height, fault)
      if (fault /= '') return
      width = spacing*(shape(height) - 1)
      high = scale*(maxval(height) - minval(height))
      if (high > steepest*maxval(width)) &
         fault = 'holds heights from '//to_text(minval(height), 4)//' to '//to_text(maxval(height), 4)// &
                 ', which with scale='//to_text(scale)//' are '//to_text(high, 3)//' m high over '// &
                 to_text(width(1), 3)//' by '//to_text(width(2), 3)//' m; allowed: at most '// &
                 to_text(nint(steepest))//' times as high as wide. scale is the m of the file''s unit'
   end subroutine doubt_heights

   !> Three columns of which the first two are all places of a grid, or at least half of them, each once.
   subroutine look_for_places(height, nx, ny)
      real(wp), intent(in) :: height(:, :)
      integer, intent(out) :: nx, ny !< places along x and y; 0: it is no list of places
      real(wp), allocatable :: x(:), y(:)
      logical, allocatable :: taken(:, :)
      integer :: n, at(2)
      nx = 0
      ny = 0
      if (size(height, 1) /= 3 .or. size(height, 2) < min_places) return
      call list_values(height(1, :), x)
      call list_values(height(2, :), y)
      associate (rows => size(height, 2))
         if (min(size(x), size(y)) < 2 .or. size(x) > rows/2 .or. size(y) > rows/2) return
         if (real(size(x), wp)*size(y) > 2.0_wp*rows) return
         allocate (taken(size(x), size(y)), source=.false.)
         do n = 1, rows
            at = [place_of(x, height(1, n)), place_of(y, height(2, n))]
            if (taken(at(1), at(2))) return
            taken(at(1), at(2)) = .true.
         end do
      end associate
      nx = size(x)
      ny = size(y)
   end subroutine look_for_places

   !> The different values of a list, rising; no more than half of it and one.
   subroutine list_values(list, values)
      real(wp), intent(in) :: list(:)
      real(wp), allocatable, intent(out) :: values(:)
      integer :: n, at
      allocate (values(0))
      do n = 1, size(list)
         at = place_of(values, list(n))
         if (at <= size(values)) then
            if (.not. values(at) > list(n)) cycle
         end if
         values = [values(:at - 1), list(n), values(at:)]
         if (size(values) > size(list)/2) return
      end do
   end subroutine list_values

   !> The first place in a rising list whose value is not below.
   pure integer function place_of(values, value) result(low)
      real(wp), intent(in) :: values(:), value
      integer :: high, middle
      low = 1
      high = size(values) + 1
      do while (low < high)
         middle = (low + high)/2
         if (values(middle) < value) then
            low = middle + 1
         else
            high = middle
         end if
      end do
   end function place_of

   !> A number that programs write where nothing was measured, further from the other heights than these are
   !> from each other.
   subroutine look_for_stand_in(height, fault)
      real(wp), intent(in) :: height(:, :)
      character(len=:), allocatable, intent(inout) :: fault
      logical :: odd(size(height, 1), size(height, 2))
      real(wp) :: lowest, highest, off
      integer :: k, at(2)
      do k = 0, size(stand_ins)
         if (k == 0) then
            odd = abs(height) >= huge_by_any_unit
         else
            odd = abs(height - stand_ins(k)) <= 0.0_wp
         end if
         if (.not. any(odd) .or. all(odd)) cycle
         lowest = minval(height, mask=.not. odd)
         highest = maxval(height, mask=.not. odd)
         at = findloc(odd, .true.)
         associate (value => height(at(1), at(2)))
            off = max(lowest - value, value - highest)
            if (.not. off > highest - lowest) cycle
            fault = 'holds '//to_text(value)//' at place '//to_text(at(1))//' of row '//to_text(at(2))// &
                    ' ('//to_text(count(odd))//' in all), which stands for no value; the others are '// &
                    to_text(lowest, 4)//' to '//to_text(highest, 4)//'. Fill it by its neighbours'
         end associate
         return
      end do
   end subroutine look_for_stand_in

end module m_height_checks
