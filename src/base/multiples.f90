!> Series of equally spaced times.
module m_multiples
   use m_kinds, only: wp
   implicit none
   private
   public :: times_passed

   real(wp), parameter :: most = 1.0e15_wp !< limit of a count: counts are exact below, and steps are longer

contains

   !> Number of the times `every`, 2 `every`, ... (s, above 0) up to `time`, within round-off; at most 1e15:
   !> where they are denser, each step has one.
   pure real(wp) function times_passed(every, time)
      real(wp), intent(in) :: every, time !< s
      times_passed = aint(min(time, most*every)/every*(1.0_wp + 1.0e-12_wp))
   end function times_passed

end module m_multiples
