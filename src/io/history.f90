!> Time histories: one Tecplot zone in point packing, which numpy.loadtxt reads if the header is skipped.
!>
!> A history has its final name from the beginning and grows by whole rows, about once a second, so that it
!> can be read during the run or after it was killed. Systems show a growing file page by page: a row after
!> which the next one would not fit on its page is padded with blanks, so that a page ends with a line, and
!> concurrent readers never see a partial row. A continued run carries over its rows.
module m_history
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files, exit_numerical
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_part_file, only: part_name, publish_part, discard_part
   use m_text_file, only: text_file_t
   use m_filesystem, only: sync_file
   use m_tecplot_snapshot, only: quoted
   use m_text, only: to_text, exact_text
   use m_timers, only: wall_time
   implicit none
   private

   integer, parameter, public :: history_text_length = 200
   integer, parameter :: value_width = 25
   integer, parameter :: count_width = 10      ! characters of the number of rows in the header
   integer(i8), parameter :: page = 4096       ! bytes; larger pages are multiples of it
   character(len=1), parameter :: newline = achar(10)
   real(wp), parameter :: flush_every = 1.0_wp ! s
   character(len=*), parameter :: value_format = '(*(1x,es24.16e3))'

   !> The header above the rows.
   type, public :: history_header_t
      character(len=:), allocatable :: title
      character(len=:), allocatable :: zone
      character(len=history_text_length), allocatable :: columns(:) !< with units: `time [s]`; the first one
                                                                    !< is the time
      character(len=history_text_length), allocatable :: notes(:) !< `name=value`, facts that hold for all
                                                                  !< rows; may be absent
      integer :: strand = 1
      real(wp) :: solution_time = 0.0_wp !< s, at the start of the history
   end type history_header_t

   !> A history being written. Only rank 0 has a file; the caller makes its errors common to all ranks.
   type, public :: history_t
      private
      character(len=:), allocatable :: path
      logical :: is_open = .false.
      type(text_file_t) :: file
      integer :: columns = 0
      integer :: rows = 0
      integer :: marked = 0 !< rows at the last mark
      integer(i8) :: head = 0 !< bytes before the first row
      integer(i8) :: count_at = 0 !< byte of the header at which the number of rows begins
      real(wp) :: flushed = 0.0_wp
   contains
      procedure :: open => open_history
      procedure :: append
      procedure :: mark
      procedure :: take_back
      procedure :: flush => flush_rows
      procedure :: sync
      procedure :: close => close_history
   end type history_t

contains

   !> Collective: open `path`. A file of this name from an earlier run is replaced; with `keep_until` its rows
   !> up to that time (s, first column) are carried over, or those of the history `from`. If the program is
   !> killed meanwhile, the old rows are still there. All ranks return with the same error (exit_files).
   subroutine open_history(self, communicator, path, header, error, keep_until, from)
      class(history_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(history_header_t), intent(in) :: header
      type(error_t), intent(inout) :: error
      real(wp), intent(in), optional :: keep_until
      character(len=*), intent(in), optional :: from
      type(error_t) :: closing
      self%path = path
      self%columns = size(header%columns)
      self%is_open = .false.
      if (communicator%is_root() .and. .not. error%happened()) then
         call self%file%open(path, error)
         self%is_open = .not. error%happened()
         if (self%is_open) call put_header(self, header, error)
         if (self%is_open .and. present(keep_until)) then
            if (present(from)) then
               call carry_over(self, from, keep_until, error)
            else
               call carry_over(self, path, keep_until, error)
            end if
         end if
         if (self%is_open .and. .not. error%happened()) call publish_part(path, error)
         if (self%is_open .and. error%happened()) then
            call self%close(closing)
            call discard_part(path)
         end if
         self%flushed = wall_time()
      end if
      call self%mark()
      call communicator%agree(error)
   end subroutine open_history

   !> Write the buffered rows to the file. No action on other ranks; rank 0 may get an error.
   subroutine flush_rows(self, error)
      class(history_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      if (self%is_open) then
         call self%file%flush(error)
         if (.not. error%happened()) call put_count(self, self%rows, error)
      end if
      self%flushed = wall_time()
   end subroutine flush_rows

   !> Update the number of rows in the header, I= of the zone, which is never larger than the number in the
   !> file.
   subroutine put_count(self, rows, error)
      type(history_t), intent(inout) :: self
      integer, intent(in) :: rows
      type(error_t), intent(inout) :: error
      character(len=count_width) :: text
      text = to_text(rows)
      call self%file%overwrite(self%count_at, text, error)
   end subroutine put_count

   !> Wait until all rows are on the disk. Rank 0 may get an error.
   subroutine sync(self, error)
      class(history_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      logical :: ok
      if (.not. self%is_open) return
      call self%flush(error)
      if (error%happened()) return
      call sync_file(self%path, ok)
      if (.not. ok) call fail(error, exit_files, 'cannot write '//self%path//': fsync failed; check the '// &
         'disk or file system')
   end subroutine sync

   !> Append a row (as many values as columns). No action on other ranks; rank 0 may get an error.
   subroutine append(self, values, error)
      class(history_t), intent(inout) :: self
      real(wp), intent(in) :: values(:)
      type(error_t), intent(inout) :: error
      character(len=value_width*size(values)) :: line
      if (.not. self%is_open) return
      if (size(values) /= self%columns) then
         call fail(error, exit_numerical, self%path//': '//to_text(size(values))//' values for '// &
                   to_text(self%columns)//' columns')
         return
      end if
      write (line, value_format) values
      call put_row(self, line, error)
      if (wall_time() - self%flushed > flush_every) call self%flush(error)
   end subroutine append

   !> Mark the present end, to which `take_back` returns.
   elemental subroutine mark(self)
      class(history_t), intent(inout) :: self
      self%marked = self%rows
   end subroutine mark

   !> Remove the rows since the mark. No action on other ranks; rank 0 may get an error.
   subroutine take_back(self, error)
      class(history_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      integer(i8) :: length, bytes
      integer :: row
      if (.not. self%is_open .or. self%rows == self%marked) return
      length = row_length(self)
      self%rows = self%marked
      bytes = self%head
      do row = 1, self%rows
         bytes = bytes + length + blanks_after(bytes + length, length)
      end do
      call put_count(self, self%rows, error)
      call self%file%take_back(self%file%bytes() - bytes, error)
   end subroutine take_back

   !> Write a row, or the header, padded with blanks to the end of its page if the next row does not fit on
   !> it.
   subroutine put_row(self, line, error)
      class(history_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      type(error_t), intent(inout) :: error
      integer(i8) :: bytes
      bytes = self%file%bytes() + len(line) + 1
      call self%file%put(line//repeat(' ', int(blanks_after(bytes, row_length(self)))), error)
      self%rows = self%rows + 1
   end subroutine put_row

   !> Length of a row with its end of line, bytes.
   pure integer(i8) function row_length(self)
      class(history_t), intent(in) :: self
      row_length = value_width*self%columns + 1_i8
   end function row_length

   !> Number of blanks to pad a page on which the next row does not fit.
   pure integer(i8) function blanks_after(bytes, length)
      integer(i8), intent(in) :: bytes, length
      blanks_after = modulo(-bytes, page)
      if (length <= blanks_after .or. length > page) blanks_after = 0
   end function blanks_after

   !> Close the history, also if the run ends early. If a row could not be written it ends with the row
   !> before.
   subroutine close_history(self, error)
      class(history_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      if (.not. self%is_open) return
      call self%flush(error)
      self%is_open = .false.
      call self%file%close(error)
   end subroutine close_history

   !> Title, variables, zone and facts.
   subroutine put_header(self, header, error)
      type(history_t), intent(inout) :: self
      type(history_header_t), intent(in) :: header
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: line, note
      integer :: c, equals
      line = 'VARIABLES='//quoted(trim(header%columns(1)))
      do c = 2, size(header%columns)
         line = line//', '//quoted(trim(header%columns(c)))
      end do
      line = 'TITLE='//quoted(header%title)//newline//line//newline//'ZONE T='//quoted(header%zone)// &
             ', STRANDID='//to_text(header%strand)//', SOLUTIONTIME='//exact_text(header%solution_time)// &
             ', I='
      self%count_at = len(line, i8)
      line = line//'0'//repeat(' ', count_width - 1)//', DATAPACKING=POINT'
      if (allocated(header%notes)) then
         do c = 1, size(header%notes)
            note = trim(header%notes(c))
            equals = max(1, index(note//'=', '='))
            line = line//newline//'AUXDATA '//identifier(note(1:equals - 1))//'='// &
                   quoted(note(equals + 1:))
         end do
      end if
      call put_row(self, line, error)
      call self%file%flush(error)
      self%head = self%file%bytes()
      self%rows = 0
   end subroutine put_header

   !> A valid Tecplot name: letters, digits and underscores.
   pure function identifier(text) result(name)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: name
      character(len=*), &
         parameter :: allowed = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_'
      integer :: i
      name = text
      do i = 1, len(name)
         if (index(allowed, name(i:i)) == 0) name(i:i) = '_'
      end do
   end function identifier

   !> Copy the rows of an earlier history up to a time (with a tolerance for round-off).
   subroutine carry_over(self, from, keep_until, error)
      type(history_t), intent(inout) :: self
      character(len=*), intent(in) :: from
      real(wp), intent(in) :: keep_until
      type(error_t), intent(inout) :: error
      character(len=2*value_width*self%columns + 2) :: line
      real(wp) :: values(self%columns)
      integer :: old, status, first, last
      logical :: ignored
      open (newunit=old, file=from, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (old, '(a)', iostat=status) line
         if (status /= 0) exit
         last = len_trim(line)
         first = last - value_width*self%columns + 1
         if (first < 1) cycle ! header, or a partial row
         if (line(:first - 1) /= '') cycle
         read (line(first:last), *, iostat=status) values
         if (status /= 0) cycle
         if (values(1) > keep_until + 1.0e-9_wp*abs(keep_until)) exit
         call put_row(self, line(first:last), error)
      end do
      close (old)
      if (.not. error%happened()) call self%flush(error)
      if (.not. error%happened()) call sync_file(part_name(self%path), ignored)
   end subroutine carry_over

end module m_history
