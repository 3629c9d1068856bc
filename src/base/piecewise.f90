!> Values that are linear between given times.
module m_piecewise
   use m_kinds, only: wp
   implicit none
   private
   public :: value_at, integral

contains

   !> The value at a time: linear between the given times, which rise; held before the first and after the last.
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
         i = count(times <= time)
         value = values(i) + (values(i + 1) - values(i))*(time - times(i))/(times(i + 1) - times(i))
      end if
   end function value_at

   !> Integral of the same from one time to another, exact for its pieces.
   pure real(wp) function integral(times, values, from, to)
      real(wp), intent(in) :: times(:), values(:), from, to
      real(wp) :: begun, ended
      integer :: i
      integral = 0.0_wp
      begun = from
      do i = 1, size(times) + 1
         ended = to
         if (i <= size(times)) ended = min(to, times(i))
         if (ended <= begun) cycle
         integral = integral + 0.5_wp*(value_at(times, values, begun) + value_at(times, values, ended))*(ended - begun)
         begun = ended
      end do
   end function integral

end module m_piecewise
