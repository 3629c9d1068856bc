!> Wall-clock time by phase of the step.
module m_timers
   use, intrinsic :: iso_fortran_env, only: int64
   use m_kinds, only: wp, i8
   implicit none
   private
   public :: timers_t

   integer, parameter, public :: phase_lists = 1, phase_to_nodes = 2, phase_exchange = 3, phase_nodes = 4, phase_contact = 5, &
                                 phase_to_particles = 6, phase_stress = 7, phase_migration = 8, phase_control = 9, &
                                 phase_balance = 10, phase_output = 11
   integer, parameter, public :: phases = 11
   character(len=12), parameter, public :: phase_names(phases) = [character(len=12) :: 'lists', 'to nodes', 'exchange', 'nodes', &
                                           'contact', 'to particles', 'stress', 'migration', 'control', 'balance', 'output']

   !> Seconds and calls of each phase on this rank. One phase runs at a time.
   type :: timers_t
      real(wp) :: seconds(phases) = 0.0_wp
      integer(i8) :: calls(phases) = 0_i8
      integer(int64), private :: begun = 0
      integer, private :: running = 0
   contains
      procedure :: enter
      procedure :: leave
   end type timers_t

   public :: wall_time

contains

   !> Wall-clock time (s) since an arbitrary moment.
   real(wp) function wall_time()
      integer(int64) :: count, rate
      call system_clock(count, rate)
      wall_time = real(count, wp)/real(rate, wp)
   end function wall_time

   !> Begin a phase; the one that runs ends here.
   subroutine enter(self, phase)
      class(timers_t), intent(inout) :: self
      integer, intent(in) :: phase
      call self%leave()
      self%running = phase
      self%calls(phase) = self%calls(phase) + 1
      call system_clock(self%begun)
   end subroutine enter

   !> End the running phase, if any.
   subroutine leave(self)
      class(timers_t), intent(inout) :: self
      integer(int64) :: now, rate
      if (self%running == 0) return
      call system_clock(now, rate)
      self%seconds(self%running) = self%seconds(self%running) + real(now - self%begun, wp)/real(rate, wp)
      self%running = 0
   end subroutine leave

end module m_timers
