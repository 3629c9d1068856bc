!> Values that are linear between given times.
module m_piecewise
   use m_kinds, only: wp
   implicit none
   private
   public :: value_at

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

end module m_piecewise
