!> The wall-clock time of a run by phase of the step, effect and level: a file, and lines for the closing
!> summary.
module m_cost_report
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_history, only: history_t, history_header_t, history_text_length
   use m_text, only: to_text, in_column, duration
   use m_timers, only: timers_t
   implicit none
   private
   public :: write_cost_report

   integer, parameter, public :: cost_line_length = 400
   integer, parameter :: columns = 7 !< of the table, before those of levels

   !> The data of the report.
   type, public :: cost_t
      type(timers_t) :: timers             !< of this rank, all stopped; the same rows on all ranks
      integer(i8) :: particle_steps = 0_i8 !< of all ranks during the run
      integer(i8), allocatable :: level_steps(:) !< of these, those on each level; may be absent
      character(len=history_text_length), allocatable :: notes(:) !< `name=value`, for the head of the file;
                                                                  !< may be absent
      real(wp) :: elapsed = 0.0_wp         !< wall-clock time of the run, s
      real(wp) :: processor = 0.0_wp       !< processor time of this rank within that, s; 0: not measured
      real(wp) :: time = 0.0_wp            !< physical time reached, s
   end type cost_t

contains

   !> Collective: write `path` (no file if it is empty), and give every rank the lines of a table. A row's
   !> cost per particle-step (ns) is the time of all ranks together over all particle-steps; its share is of
   !> the elapsed time. With several levels, each has two more columns: seconds, and ns per particle-step of
   !> the level.
   subroutine write_cost_report(communicator, cost, path, lines, error)
      type(communicator_t), intent(in) :: communicator
      type(cost_t), intent(in) :: cost
      character(len=*), intent(in) :: path
      character(len=cost_line_length), allocatable, intent(out) :: lines(:)
      type(error_t), intent(inout) :: error
      type(history_t) :: table
      real(wp) :: values(columns + 2*level_count(cost), rows_of(cost))
      integer :: r
      call gather(communicator, cost, values)
      call make_lines(communicator, cost, values, lines)
      call add_processor(communicator, cost, lines)
      if (path == '') return
      call table%open(communicator, path, header(communicator, cost), error)
      do r = 1, size(values, 2)
         if (.not. error%happened()) call table%append(values(:, r), error)
      end do
      call table%close(error)
      call communicator%agree(error)
   end subroutine write_cost_report

   !> Number of rows of the report: those of the timers, the remainder, the total.
   pure integer function rows_of(cost) result(rows)
      type(cost_t), intent(in) :: cost
      rows = size(cost%timers%seconds) + 2
   end function rows_of

   !> Columns: number of the row, seconds min, mean, max over the ranks, calls, ns per particle-step, share in
   !> percent; then of each level the mean of the seconds over the ranks and ns per particle-step of the
   !> level.
   subroutine gather(communicator, cost, values)
      type(communicator_t), intent(in) :: communicator
      type(cost_t), intent(in) :: cost
      real(wp), intent(out) :: values(:, :) !< (columns, rows)
      real(wp), dimension(size(values, 2)) :: least, total, most
      integer(i8) :: calls(size(cost%timers%calls))
      integer :: r, rows, timed
      rows = size(values, 2)
      timed = rows - 2
      total(1:timed) = cost%timers%seconds
      total(timed + 1) = max(0.0_wp, cost%elapsed - sum(cost%timers%seconds))
      total(rows) = cost%elapsed
      call MPI_Allreduce(total, least, rows, MPI_DOUBLE_PRECISION, MPI_MIN, communicator%comm)
      call MPI_Allreduce(total, most, rows, MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, total, rows, MPI_DOUBLE_PRECISION, MPI_SUM, communicator%comm)
      call MPI_Allreduce(cost%timers%calls, calls, timed, MPI_INTEGER8, MPI_MAX, communicator%comm)
      values = 0.0_wp
      values(5, 1:timed) = real(calls, wp)
      do r = 1, rows
         values(1:4, r) = [real(r, wp), least(r), total(r)/communicator%ranks, most(r)]
         if (cost%particle_steps > 0) values(6, r) = 1.0e9_wp*total(r)/real(cost%particle_steps, wp)
         if (total(rows) > 0.0_wp) values(7, r) = 100.0_wp*total(r)/total(rows)
      end do
      if (level_count(cost) > 0) call p2g_levels(communicator, cost, values)
   end subroutine gather

   !> Fill the columns of the levels. Time that belongs to no level (output, balance) is in none of them.
   subroutine p2g_levels(communicator, cost, values)
      type(communicator_t), intent(in) :: communicator
      type(cost_t), intent(in) :: cost
      real(wp), intent(inout) :: values(:, :)
      real(wp) :: total(size(cost%timers%seconds), size(cost%level_steps))
      integer :: l, rows
      call MPI_Allreduce(cost%timers%on_levels, total, size(total), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
      rows = size(values, 2)
      do l = 1, size(total, 2)
         associate (seconds => values(columns + 2*l - 1, :), each => values(columns + 2*l, :))
            seconds(:rows - 2) = total(:, l)/communicator%ranks
            seconds(rows) = sum(seconds(:rows - 2))
            if (cost%level_steps(l) > 0) &
               each = 1.0e9_wp*seconds*communicator%ranks/real(cost%level_steps(l), wp)
         end associate
      end do
   end subroutine p2g_levels

   !> Number of levels to report: 0 if there is only one.
   pure integer function level_count(cost) result(levels)
      type(cost_t), intent(in) :: cost
      levels = 0
      if (allocated(cost%level_steps)) levels = size(cost%level_steps)
      if (levels == 1) levels = 0
   end function level_count

   !> Name of a row.
   pure function row_name(cost, r) result(name)
      type(cost_t), intent(in) :: cost
      integer, intent(in) :: r
      character(len=len(cost%timers%names)) :: name
      name = 'all'
      if (r == rows_of(cost) - 1) name = 'the rest'
      if (r < rows_of(cost) - 1) name = cost%timers%names(r)
   end function row_name

   function header(communicator, cost) result(head)
      type(communicator_t), intent(in) :: communicator
      type(cost_t), intent(in) :: cost
      type(history_header_t) :: head
      integer :: l, levels, r, rows
      rows = rows_of(cost)
      levels = level_count(cost)
      head%title = 'where the time went, by phase of the step, effect and level'
      head%zone = 'cost'
      head%solution_time = cost%time
      allocate (head%columns(columns + 2*levels), head%notes(rows + 3 + levels))
      head%columns(:columns) = [character(len=history_text_length) :: 'phase [-]', 'least of the ranks [s]', &
                                'mean of the ranks [s]', 'most of the ranks [s]', 'calls [-]', &
                                'all ranks per particle-step [ns]', 'share of elapsed time [%]']
      do r = 1, rows
         head%notes(r) = 'phase_'//to_text(r)//'='//trim(row_name(cost, r))
      end do
      head%notes(rows + 1) = 'ranks='//to_text(communicator%ranks)
      head%notes(rows + 2) = 'particle_steps='//to_text(cost%particle_steps)
      head%notes(rows + 3) = 'elapsed_s='//to_text(cost%elapsed)
      do l = 1, levels
         head%notes(rows + 3 + l) = 'particle_steps_level_'//to_text(l)//'='//to_text(cost%level_steps(l))
         head%columns(columns + 2*l - 1) = 'level '//to_text(l)//' mean of the ranks [s]'
         head%columns(columns + 2*l) = 'level '//to_text(l)//' all ranks per particle-step of the level [ns]'
      end do
      if (allocated(cost%notes)) head%notes = [head%notes, cost%notes]
   end function header

   !> The table as text.
   subroutine make_lines(communicator, cost, values, lines)
      type(communicator_t), intent(in) :: communicator
      type(cost_t), intent(in) :: cost
      real(wp), intent(in) :: values(:, :)
      character(len=cost_line_length), allocatable, intent(out) :: lines(:)
      integer :: c, l, r, n, rows, shown(size(values, 2))
      rows = size(values, 2)
      n = 0
      do r = 1, rows
         if (values(4, r) <= 0.0_wp .and. r < rows) cycle ! a phase that this run does not have
         n = n + 1
         shown(n) = r
      end do
      allocate (lines(n + 2 + merge(n + 1 + level_count(cost), 0, level_count(cost) > 0)))
      write (lines(1), '(a20,3a11,a12,a16,a9)') 'seconds             ', 'least', 'mean', 'most', 'calls', &
         'ns/part.-step', 'share'
      do r = 1, n
         associate (v => values(:, shown(r)))
            write (lines(r + 1), '(a20,3a11,i12,a16,f7.1,a)') row_name(cost, shown(r)), &
               (in_column(v(c), 11, 3), c=2, 4), int(v(5), i8), in_column(v(6), 16, 2), v(7), ' %'
         end associate
      end do
      lines(n + 2) = to_text(cost%particle_steps)//' particle-steps on '//to_text(communicator%ranks)// &
                     ' ranks in '//duration(values(4, rows))
      if (values(4, rows) > 0.0_wp) lines(n + 2) = trim(lines(n + 2))//': '// &
                                                   to_text(real(cost%particle_steps, wp)/values(4, rows), &
                                                           3)//' a second'
      do l = 1, level_count(cost)
         lines(n + 2 + l) = 'level '//to_text(l)//': '//to_text(cost%level_steps(l))//' particle-steps'
         if (cost%particle_steps > 0) lines(n + 2 + l) = trim(lines(n + 2 + l))//', '// &
            to_text(100.0_wp*real(cost%level_steps(l), wp)/real(cost%particle_steps, wp), 3)//' %'
      end do
      if (level_count(cost) > 0) &
         call add_level_lines(cost, values(:, shown(:n)), shown(:n), lines(n + 3 + level_count(cost):))
   end subroutine make_lines

   !> Collective: one more line, with the share of the time in which the processors worked for the run. The
   !> rest went to other jobs or to waiting for files.
   subroutine add_processor(communicator, cost, lines)
      type(communicator_t), intent(in) :: communicator
      type(cost_t), intent(in) :: cost
      character(len=cost_line_length), allocatable, intent(inout) :: lines(:)
      character(len=cost_line_length) :: line
      real(wp) :: worked, elapsed
      worked = communicator%sum_real(cost%processor)
      elapsed = communicator%sum_real(cost%elapsed)
      if (worked <= 0.0_wp .or. elapsed <= 0.0_wp) return
      line = 'processors: '//duration(worked)//' of work, '//to_text(100.0_wp*worked/elapsed, 3)// &
             ' % of the elapsed time'
      lines = [lines, line]
   end subroutine add_processor

   !> The same rows by level: seconds (mean of the ranks), and ns per particle-step of the level.
   subroutine add_level_lines(cost, values, shown, lines)
      type(cost_t), intent(in) :: cost
      real(wp), intent(in) :: values(:, :) !< of the rows that are shown
      integer, intent(in) :: shown(:)
      character(len=cost_line_length), intent(out) :: lines(:) !< one more than rows
      integer :: l, r
      lines(1) = 's, ns/part.-step'
      do l = 1, level_count(cost)
         write (lines(1)(22*l - 1:22*l + 20), '(a22)') 'level '//to_text(l)
      end do
      do r = 1, size(shown)
         lines(r + 1) = row_name(cost, shown(r))
         do l = 1, level_count(cost)
            lines(r + 1)(22*l - 1:22*l + 20) = in_column(values(columns + 2*l - 1, r), 11, 3)// &
                                               in_column(values(columns + 2*l, r), 11, 2)
         end do
      end do
   end subroutine add_level_lines

end module m_cost_report
