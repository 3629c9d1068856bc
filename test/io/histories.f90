!test: ranks 1 2 4
!> Curves, the console with its log, and the cost report, below the directory given as argument (read_back.py
!> reads them).
program histories
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use mpi_f08, only: MPI_Barrier
   use m_kinds, only: wp
   use m_constants, only: exit_files, exit_numerical
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_filesystem, only: make_directory, read_file
   use m_history, only: history_t, history_header_t, history_text_length
   use m_console, only: console_t
   use m_cost_report, only: write_cost_report, cost_t, cost_line_length
   use m_text, only: to_text
   use m_timers, only: wall_time, phase_stress, phase_output
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   character(len=512) :: argument
   character(len=:), allocatable :: top
   logical :: ok
   call get_command_argument(1, argument)
   top = 'build/test_io'
   if (len_trim(argument) > 0) top = trim(argument)
   call comm%start()
   call test%start(comm, 'histories')
   call make_directory(top, ok)
   call one_curve()
   call taken_up_again()
   call taken_back()
   call with_nan()
   call must_fail()
   call talk()
   call costs()
   call test%finish()

contains

   function header(title) result(head)
      character(len=*), intent(in) :: title
      type(history_header_t) :: head
      head%title = title
      head%zone = 'made "up"'
      head%strand = 2
      head%solution_time = 0.0_wp
      allocate (head%columns(3), head%notes(2))
      head%columns(:) = [character(len=history_text_length) :: 'time [s]', 'depth [m]', 'load_x [N]']
      head%notes(:) = [character(len=history_text_length) :: 'symmetry=quarter model', 'shape of it=a "cone"']
   end function header

   subroutine rows(curve, first, last, error)
      type(history_t), intent(inout) :: curve
      integer, intent(in) :: first, last
      type(error_t), intent(inout) :: error
      integer :: n
      do n = first, last
         call curve%append([n*1.1e-12_wp, -n/3.0_wp, 1.0e-300_wp*n], error)
      end do
   end subroutine rows

   !> Under its own name from the beginning, and whole lines of it at any time.
   subroutine one_curve()
      type(history_t) :: curve
      type(error_t) :: error
      character(len=:), allocatable :: text
      integer :: block
      call curve%open(comm, top//'/curve.dat', header('one curve'), error)
      call expect_there(top//'/curve.dat', .true., 'a curve from the beginning')
      call expect_there(top//'/curve.dat.part', .false., 'no part of it')
      do block = 0, 9
         call rows(curve, 10*block, 10*block + 9, error)
         if (block == 5) call curve%flush(error)
         if (.not. comm%is_root()) cycle
         text = bytes('curve.dat')
         call test%check(text(len(text):) == new_line('a'), 'whole lines while it is written')
         call test%check(whole_on_pages(text), 'no row lies across the end of a page')
         if (block == 5) call test%check(index(text, to_text_of(59*1.1e-12_wp)) > 0, 'all rows after a flush')
      end do
      call rows(curve, 100, 100, error)
      call curve%close(error)
      call test%check(.not. error%happened(), 'a curve is written')
      call curve%close(error)
      call test%check(.not. error%happened(), 'closing twice does no harm')
   end subroutine one_curve

   !> Whether each page ends with a line.
   pure logical function whole_on_pages(text) result(whole)
      character(len=*), intent(in) :: text
      integer :: page
      whole = .true.
      do page = 4096, len(text), 4096
         whole = whole .and. text(page:page) == new_line('a')
      end do
   end function whole_on_pages

   !> A number as it stands in a row.
   function to_text_of(value) result(text)
      real(wp), intent(in) :: value
      character(len=24) :: text
      write (text, '(es24.16e3)') value
   end function to_text_of

   !> Rows that are taken back have never been: the same bytes as of a curve without them, also where none
   !> follow.
   subroutine taken_back()
      type(history_t) :: plain, curve, short
      type(error_t) :: error
      call plain%open(comm, top//'/plain.dat', header('taken back'), error)
      call rows(plain, 0, 80, error)
      call plain%close(error)
      call curve%open(comm, top//'/back.dat', header('taken back'), error)
      call rows(curve, 0, 70, error)
      call curve%mark()
      call rows(curve, 71, 100, error)
      call curve%sync(error)
      call curve%take_back(error)
      call rows(curve, 71, 90, error)
      call curve%take_back(error)
      call curve%take_back(error)
      call rows(curve, 71, 80, error)
      call curve%close(error)
      call short%open(comm, top//'/short.dat', header('taken back'), error)
      call rows(short, 0, 80, error)
      call short%mark()
      call rows(short, 81, 90, error)
      call short%take_back(error)
      call short%close(error)
      call test%check(.not. error%happened(), 'rows are taken back')
      if (comm%is_root()) then
         call test%check(bytes('back.dat') == bytes('plain.dat'), &
                         'rows that were taken back and others in their place')
         call test%check(bytes('short.dat') == bytes('plain.dat'), 'rows that were taken back at the end')
         call test%check(len(bytes('plain.dat')) > 5000, 'there are rows')
      end if
   end subroutine taken_back

   !> All of a file.
   function bytes(name) result(text)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      logical :: ok
      call read_file(top//'/'//name, 1000000, text, ok)
      call test%check(ok, name//' can be read')
   end function bytes

   !> A run that was killed: rows past the checkpoint and a torn line are there; then taken up again, stopped
   !> and taken up.
   subroutine taken_up_again()
      type(history_t) :: curve
      type(error_t) :: error
      integer :: unit
      if (comm%is_root()) then
         call curve%open(comm_of_one(), top//'/again.dat', header('taken up again'), error)
         call rows(curve, 0, 60, error)
         call curve%close(error)
         open (newunit=unit, file=top//'/again.dat', position='append', action='write')
         write (unit, '(a)', advance='no') '   6.71000000E-0'
         close (unit)
      end if
      call comm%agree(error)
      call curve%open(comm, top//'/again.dat', header('taken up again'), error, keep_until=40*1.1e-12_wp)
      call rows(curve, 41, 80, error)
      call curve%close(error)
      call curve%open(comm, top//'/again.dat', header('taken up again'), error, keep_until=70*1.1e-12_wp)
      call rows(curve, 71, 100, error)
      call curve%close(error)
      call test%check(.not. error%happened(), 'a curve is taken up again')
      call expect_there(top//'/again.dat.old', .false., 'nothing else is left of a curve taken up again')
   end subroutine taken_up_again

   !> A communicator whose operations need no other rank.
   function comm_of_one() result(one)
      use mpi_f08, only: MPI_COMM_SELF
      type(communicator_t) :: one
      one%comm = MPI_COMM_SELF
   end function comm_of_one

   !> Not a number must read back as such.
   subroutine with_nan()
      type(history_t) :: curve
      type(error_t) :: error
      real(wp) :: nan
      nan = ieee_value(nan, ieee_quiet_nan)
      call curve%open(comm, top//'/nan.dat', header('not a number'), error)
      call curve%append([0.0_wp, nan, -huge(nan)], error)
      call curve%append([1.0_wp, 2.0_wp, -tiny(nan)], error)
      call curve%close(error)
   end subroutine with_nan

   subroutine must_fail()
      type(history_t) :: curve
      type(error_t) :: error, other
      call curve%open(comm, top//'/no/such/curve.dat', header(''), error)
      call test%check(error%status == exit_files, 'a curve in no directory: exit status')
      if (error%happened()) call test%check(index(error%message, '/no/such/curve.dat') > 0, &
                                            'a curve in no directory: path', error%message)
      call curve%open(comm, top//'/width.dat', header(''), other)
      call curve%append([1.0_wp], other)
      call comm%agree(other)
      call test%check(other%status == exit_numerical, 'a row that is too short is refused')
      call curve%close(other)
   end subroutine must_fail

   !> Lines before and after the log is open; progress not more than once a second.
   subroutine talk()
      type(console_t) :: console
      type(error_t) :: error
      real(wp) :: began, took
      integer :: step, n, lines
      character(len=:), allocatable :: text
      call console%start(comm)
      call console%line('before the log')
      call console%open_log(comm, top//'/run.log', error)
      began = wall_time()
      step = 0
      took = 0.0_wp
      do while (took < 2.5_wp)
         step = step + 1
         took = wall_time() - began
         call console%progress(step, step*1.0e-12_wp, 1.0e-3_wp, 1.23456e-5_wp)
      end do
      took = wall_time() - began
      call console%summary('Finished.', step, step*1.0e-12_wp, [character(len=8) :: 'a table', 'of cost'])
      call console%finish()
      if (.not. comm%is_root()) return
      call read_file(top//'/run.log', 100000, text, ok)
      call test%check(ok .and. index(text, 'before the log') == 1, 'the log begins with what was said before')
      lines = 0
      do n = 1, len(text) - 20
         if (text(n:n + 19) == 'energy balance error') lines = lines + 1
      end do
      call test%check(lines >= 1 .and. lines <= took, 'at most one line of progress a second', to_text(lines))
      call test%check(index(text, 'balance error 0.0012 %') > 0 .and. index(text, ' of 1 ms ') > 0 &
                      .and. index(text, ' steps/s ') > 0 .and. index(text, 'time left ') > 0, &
                      'what progress says')
      call test%check(index(text, 'of cost') > 0, 'the closing words are in the log')
      call console%open_log(comm_of_one(), top//'/no/such/run.log', error)
   end subroutine talk

   subroutine costs()
      type(cost_t) :: cost
      type(error_t) :: error
      character(len=cost_line_length), allocatable :: lines(:)
      call cost%timers%start()
      cost%timers%seconds(phase_stress) = 1.0_wp + comm%rank
      cost%timers%seconds(phase_output) = 0.5_wp
      cost%timers%calls(phase_stress) = 10
      cost%particle_steps = 1000000000
      cost%elapsed = 10.0_wp
      cost%time = 1.5e-9_wp
      call write_cost_report(comm, cost, top//'/cost.dat', lines, error)
      call test%check(.not. error%happened(), 'the cost report is written')
      call test%check_equal(size(lines), 6, 'lines of the cost report')
      call test%check(index(lines(2), 'stress') == 1, 'the cost report names the phases', lines(2))
      call write_cost_report(comm, cost, '', lines, error)
      call test%check(.not. error%happened() .and. size(lines) == 6, &
                      'the cost report of a scene without output has lines alone')
      cost%processor = 4.0_wp
      call write_cost_report(comm, cost, '', lines, error)
      call test%check(size(lines) == 7, 'one line more where it is known how long processors worked')
      call test%check(index(lines(7), 'processors: ') == 1 .and. index(lines(7), ' work, 40 % of the') > 0, &
                      'what share of the time it was', lines(7))
   end subroutine costs

   subroutine expect_there(path, expected, name)
      character(len=*), intent(in) :: path, name
      logical, intent(in) :: expected
      logical :: there
      call MPI_Barrier(comm%comm)
      if (comm%is_root()) then
         inquire (file=path, exist=there)
         call test%check(there .eqv. expected, name)
      end if
      call MPI_Barrier(comm%comm)
   end subroutine expect_there

end program histories
