!> Console output and log of a run, from rank 0.
module m_console
   use, intrinsic :: iso_fortran_env, only: output_unit
   use m_kinds, only: wp
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_text, only: to_text, si, duration
   use m_timers, only: wall_time, processor_time
   implicit none
   private

   real(wp), parameter :: progress_every = 1.0_wp ! s between two progress lines
   real(wp), parameter :: memory = 10.0_wp        ! s over which the pace is averaged

   type :: line_t
      character(len=:), allocatable :: text
   end type line_t

   !> The console. Lines written before the log is open are kept and copied to it.
   type, public :: console_t
      private
      logical :: speaks = .false.
      logical :: logs = .false.
      integer :: unit = 0
      type(line_t), allocatable :: earlier(:)
      real(wp) :: began = 0.0_wp       ! wall time, s
      real(wp) :: worked = 0.0_wp      ! processor time by then, s
      real(wp) :: last_wall = 0.0_wp   ! of the last progress line
      real(wp) :: last_time = 0.0_wp   ! physical time then, s
      integer :: last_step = -1        ! -1: no step seen yet
      real(wp) :: time_pace = 0.0_wp   ! physical seconds a wall second, averaged
      real(wp) :: step_pace = 0.0_wp   ! steps a wall second, averaged
   contains
      procedure :: start
      procedure :: open_log
      procedure :: line
      procedure :: lines
      procedure :: progress
      procedure :: summary
      procedure :: elapsed
      procedure :: processor
      procedure :: finish
   end type console_t

contains

   !> Start the console (rank 0 only) and the wall clock of the run.
   subroutine start(self, communicator)
      class(console_t), intent(out) :: self
      type(communicator_t), intent(in) :: communicator
      self%speaks = communicator%is_root()
      self%began = wall_time()
      self%worked = processor_time()
      self%last_wall = self%began
      allocate (self%earlier(0))
   end subroutine start

   !> Collective: from here on write everything to the log too, line by line without delay, including the
   !> lines so far. With `resume` the log is appended to. All ranks return with the same error (exit_files).
   subroutine open_log(self, communicator, path, error, resume)
      class(console_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      logical, intent(in), optional :: resume
      character(len=256) :: reason
      character(len=:), allocatable :: place, state
      integer :: status, n
      if (self%speaks .and. .not. error%happened()) then
         place = 'asis'
         state = 'replace'
         if (present(resume)) then
            if (resume) then
               place = 'append'
               state = 'unknown'
            end if
         end if
         open (newunit=self%unit, file=path, status=state, position=place, action='write', iostat=status, &
               iomsg=reason)
         if (status /= 0) call fail(error, exit_files, 'cannot write '//path//': '//trim(reason))
         self%logs = status == 0
         if (self%logs) then
            do n = 1, size(self%earlier)
               call put(self%unit, self%earlier(n)%text)
            end do
         end if
      end if
      call communicator%agree(error)
   end subroutine open_log

   !> Write one line.
   subroutine line(self, text)
      class(console_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      if (.not. self%speaks) return
      call put(output_unit, text)
      if (self%logs) then
         call put(self%unit, text)
      else
         self%earlier = [self%earlier, line_t(text)]
      end if
   end subroutine line

   !> Write several lines, each ended by new_line.
   subroutine lines(self, text)
      class(console_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer :: first, length
      first = 1
      do while (first <= len(text))
         length = index(text(first:), new_line('a'))
         if (length == 0) length = len(text) - first + 2
         call self%line(text(first:first + length - 2))
         first = first + length
      end do
   end subroutine lines

   !> Called every step; prints a progress line at most once a second. The energy balance error is relative
   !> (dimensionless).
   subroutine progress(self, step, time, end_time, balance_error)
      class(console_t), intent(inout) :: self
      integer, intent(in) :: step
      real(wp), intent(in) :: time     !< physical time, s
      real(wp), intent(in) :: end_time !< s
      real(wp), intent(in) :: balance_error
      real(wp) :: now, span, share, weight
      character(len=:), allocatable :: left
      if (.not. self%speaks) return
      now = wall_time()
      span = now - self%last_wall
      if (self%last_step >= 0 .and. span < progress_every) return
      if (self%last_step >= 0) then
         weight = 1.0_wp
         if (self%step_pace > 0.0_wp) weight = span/(span + memory)
         self%step_pace = self%step_pace + weight*((step - self%last_step)/span - self%step_pace)
         self%time_pace = self%time_pace + weight*((time - self%last_time)/span - self%time_pace)
         share = 1.0_wp
         if (end_time > 0.0_wp) share = time/end_time
         left = 'unknown'
         if (self%time_pace > 0.0_wp) left = duration(max(0.0_wp, end_time - time)/self%time_pace)
         call self%line('step '//to_text(step)//'   time '//si(time, 's')//' of '//si(end_time, 's')// &
                        '   '// &
                        tenths(100.0_wp*share)//' %   time left '//left//'   '// &
                           to_text(self%step_pace, 3)//' steps/s'// &
                        '   energy balance error '//to_text(100.0_wp*balance_error, 2)//' %')
      end if
      self%last_wall = now
      self%last_step = step
      self%last_time = time
   end subroutine progress

   !> The closing summary: how the run ended, its steps and time, and lines of the caller (for instance those
   !> of the cost report).
   subroutine summary(self, outcome, step, time, lines)
      class(console_t), intent(inout) :: self
      character(len=*), intent(in) :: outcome  !< how the run ended, one sentence
      integer, intent(in) :: step
      real(wp), intent(in) :: time             !< physical time reached, s
      character(len=*), intent(in) :: lines(:)
      integer :: n
      if (.not. self%speaks) return
      call self%line('')
      call self%line(outcome)
      call self%line(to_text(step)//' steps to '//si(time, 's')//' in '//duration(self%elapsed()))
      do n = 1, size(lines)
         call self%line(trim(lines(n)))
      end do
   end subroutine summary

   !> Wall-clock time since start (s).
   real(wp) function elapsed(self)
      class(console_t), intent(in) :: self
      elapsed = wall_time() - self%began
   end function elapsed

   !> Processor time of this rank since start (s).
   real(wp) function processor(self)
      class(console_t), intent(in) :: self
      processor = processor_time() - self%worked
   end function processor

   !> Close the log.
   subroutine finish(self)
      class(console_t), intent(inout) :: self
      if (self%logs) close (self%unit)
      self%logs = .false.
      self%speaks = .false.
   end subroutine finish

   !> Write a line to a unit and flush it. A full disk must not end the run, so the status is ignored.
   subroutine put(unit, text)
      integer, intent(in) :: unit
      character(len=*), intent(in) :: text
      integer :: ignored
      write (unit, '(a)', iostat=ignored) text
      flush (unit, iostat=ignored)
   end subroutine put

   !> A percentage with one decimal.
   pure function tenths(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=16) :: buffer
      write (buffer, '(f9.1)') min(max(value, -9999.0_wp), 9999.0_wp)
      text = trim(adjustl(buffer))
   end function tenths

end module m_console
