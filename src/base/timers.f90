!> Wall-clock time by phase of the step, and by effect.
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

   integer, parameter :: name_length = 20 ! of effects' groups too

   !> Seconds and calls of each row on this rank: the phases, then one row an effect. One row runs at a time.
   type :: timers_t
      character(len=name_length), allocatable :: names(:)
      real(wp), allocatable :: seconds(:)
      integer(i8), allocatable :: calls(:)
      integer(int64), private :: begun = 0
      integer, private :: running = 0
   contains
      procedure :: start
      procedure :: row_of
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

   !> The rows of the phases, at zero.
   subroutine start(self)
      class(timers_t), intent(out) :: self
      self%names = [character(len=name_length) :: phase_names]
      allocate (self%seconds(phases), source=0.0_wp)
      allocate (self%calls(phases), source=0_i8)
   end subroutine start

   !> The row with a name behind those of the phases; a new one at the end if there is none yet.
   integer function row_of(self, name) result(row)
      class(timers_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=name_length) :: short
      short = name
      do row = phases + 1, size(self%names)
         if (self%names(row) == short) return
      end do
      self%names = [self%names, short]
      self%seconds = [self%seconds, 0.0_wp]
      self%calls = [self%calls, 0_i8]
   end function row_of

   !> Begin a row; the one that runs ends here.
   subroutine enter(self, row)
      class(timers_t), intent(inout) :: self
      integer, intent(in) :: row
      call self%leave()
      self%running = row
      self%calls(row) = self%calls(row) + 1
      call system_clock(self%begun)
   end subroutine enter

   !> End the running row, if any.
   subroutine leave(self)
      class(timers_t), intent(inout) :: self
      integer(int64) :: now, rate
      if (self%running == 0) return
      call system_clock(now, rate)
      self%seconds(self%running) = self%seconds(self%running) + real(now - self%begun, wp)/real(rate, wp)
      self%running = 0
   end subroutine leave

end module m_timers
