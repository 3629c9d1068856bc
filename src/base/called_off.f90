!> Requests from outside to end a run, polled during steps that may take long: signals, and the wall-clock
!> limit.
module m_called_off
   use m_kinds, only: wp
   use m_signals, only: signal_caught, signal_interrupt, signal_terminate
   use m_timers, only: wall_time
   implicit none
   private
   public :: called_off_t

   !> A rank's request to the run; the largest of all ranks counts.
   integer, parameter, public :: asks_checkpoint = 1, asks_end_limit = 2, asks_end_interrupt = 3, &
                                 asks_end_terminate = 4
   integer, parameter, public :: asks_end_lost = 5 !< another run owns the directory now: nothing may be
                                                   !< written any more

   type :: called_off_t
      real(wp) :: deadline = huge(1.0_wp) !< of this rank, as wall_time, s
   contains
      procedure :: asks
   end type called_off_t

contains

   !> This rank's request to the run now: 0, or that it ends.
   integer function asks(self)
      class(called_off_t), intent(in) :: self
      asks = 0
      select case (signal_caught())
      case (signal_interrupt); asks = asks_end_interrupt
      case (signal_terminate); asks = asks_end_terminate
      end select
      if (asks == 0 .and. wall_time() >= self%deadline) asks = asks_end_limit
   end function asks

end module m_called_off
