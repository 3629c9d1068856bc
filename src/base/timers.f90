!> Wall-clock time by phase of the step, by effect and by level.
module m_timers
   use, intrinsic :: iso_fortran_env, only: int64
   use m_kinds, only: wp, i8
   implicit none
   private
   public :: timers_t

   integer, parameter, public :: phase_lists = 1, phase_p2g = 2, phase_exchange = 3, phase_nodes = 4, &
                                 phase_contact = 5, phase_g2p = 6, phase_stress = 7, phase_migration = 8, &
                                 phase_control = 9, phase_balance = 10, phase_output = 11
   integer, parameter, public :: phases = 11
   character(len=12), parameter, public :: phase_names(phases) = [character(len=12) :: 'lists', 'P2G', &
      'exchange', 'nodes', 'contact', 'G2P', 'stress', 'migration', 'control', 'balance', 'output']

   integer, parameter :: name_length = 20 ! of effects' groups too

   !> Seconds and calls of each row on this rank: the phases, then one row an effect. One row is timed at a
   !> time, on one level.
   type :: timers_t
      character(len=name_length), allocatable :: names(:)
      real(wp), allocatable :: seconds(:)
      real(wp), allocatable :: on_levels(:, :) !< part of these on each level: (rows, levels)
      integer(i8), allocatable :: calls(:)
      integer(int64), private :: begun = 0
      integer, private :: running = 0
      integer, private :: level = 0            !< 0: none
   contains
      procedure :: start
      procedure :: row_of
      procedure :: on_level
      procedure :: enter
      procedure :: leave
   end type timers_t

   public :: wall_time, processor_time

contains

   !> Wall-clock time (s) since an arbitrary moment.
   real(wp) function wall_time()
      integer(int64) :: count, rate
      call system_clock(count, rate)
      wall_time = real(count, wp)/real(rate, wp)
   end function wall_time

   !> Processor time (s) of this process.
   real(wp) function processor_time()
      call cpu_time(processor_time)
   end function processor_time

   !> Initialise the rows of the phases to zero.
   subroutine start(self, levels)
      class(timers_t), intent(out) :: self
      integer, intent(in), optional :: levels !< 1 if absent
      integer :: columns
      columns = 1
      if (present(levels)) columns = levels
      self%names = [character(len=name_length) :: phase_names]
      allocate (self%seconds(phases), source=0.0_wp)
      allocate (self%on_levels(phases, columns), source=0.0_wp)
      allocate (self%calls(phases), source=0_i8)
   end subroutine start

   !> The row with a name after those of the phases; a new one at the end if there is none yet.
   integer function row_of(self, name) result(row)
      class(timers_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=name_length) :: short
      real(wp), allocatable :: more(:, :)
      short = name
      do row = phases + 1, size(self%names)
         if (self%names(row) == short) return
      end do
      self%names = [self%names, short]
      self%seconds = [self%seconds, 0.0_wp]
      self%calls = [self%calls, 0_i8]
      allocate (more(row, size(self%on_levels, 2)), source=0.0_wp)
      more(:row - 1, :) = self%on_levels
      call move_alloc(more, self%on_levels)
   end function row_of

   !> Attribute time to a level from here on; 0: to none. Stops the running row, if any.
   subroutine on_level(self, level)
      class(timers_t), intent(inout) :: self
      integer, intent(in) :: level
      call self%leave()
      self%level = level
   end subroutine on_level

   !> Start a row; stops the running one.
   subroutine enter(self, row)
      class(timers_t), intent(inout) :: self
      integer, intent(in) :: row
      call self%leave()
      self%running = row
      self%calls(row) = self%calls(row) + 1
      call system_clock(self%begun)
   end subroutine enter

   !> Stop the running row, if any.
   subroutine leave(self)
      class(timers_t), intent(inout) :: self
      integer(int64) :: now, rate
      real(wp) :: span
      if (self%running == 0) return
      call system_clock(now, rate)
      span = real(now - self%begun, wp)/real(rate, wp)
      self%seconds(self%running) = self%seconds(self%running) + span
      if (self%level > 0) self%on_levels(self%running, self%level) = self%on_levels(self%running, &
            self%level) + span
      self%running = 0
   end subroutine leave

end module m_timers
