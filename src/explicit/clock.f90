!> The times of a step of one level.
module m_clock
   use m_kinds, only: wp
   implicit none
   private

   type, public :: clock_t
      real(wp) :: time = 0.0_wp      !< at its beginning, s
      real(wp) :: step = 0.0_wp      !< its length, s
      real(wp) :: remaining = 0.0_wp !< from the time of its velocities, its middle, to the middle of the
                                     !< coarser level's step, s
      logical :: ends = .true.       !< its end is the end of the coarsest level's step
   end type clock_t

end module m_clock
