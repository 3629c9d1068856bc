!> Piecewise linear functions of time.
module m_piecewise
   use m_kinds, only: wp
   implicit none
   private
   public :: value_at, integral

contains

   !> The value at a time: linear between the given times, which rise; constant before the first and after the
   !> last.
   pure real(wp) function value_at(times, values, time) result(value)
      real(wp), intent(in) :: times(:), values(:) !< of equal size, at least 1
      real(wp), intent(in) :: time
      integer :: i, n
      n = size(times)
      if (time <= times(1)) then
         value = values(1)
      else if (time >= times(n)) then
         value = values(n)
      else
         i = last_before(times, time)
         value = values(i) + (values(i + 1) - values(i))*(time - times(i))/(times(i + 1) - times(i))
      end if
   end function value_at

   !> Exact integral of the same between two times.
   pure real(wp) function integral(times, values, from, to)
      real(wp), intent(in) :: times(:), values(:), from, to
      real(wp) :: begun, ended
      integer :: i
      integral = 0.0_wp
      begun = from
      do i = max(1, last_before(times, from)), size(times) + 1
         if (begun >= to) exit
         ended = to
         if (i <= size(times)) ended = min(to, times(i))
         if (ended <= begun) cycle
         integral = integral + 0.5_wp*(value_at(times, values, begun) &
                                       + value_at(times, values, ended))*(ended - begun)
         begun = ended
      end do
   end function integral

   !> Number of the times, which rise, at or before this one; by bisection, for they may be many.
   pure integer function last_before(times, time) result(low)
      real(wp), intent(in) :: times(:), time
      integer :: high, middle
      low = 0
      high = size(times) + 1
      do while (high - low > 1)
         middle = (low + high)/2
         if (times(middle) <= time) then
            low = middle
         else
            high = middle
         end if
      end do
   end function last_before

end module m_piecewise
