!> The header line of column names of a text: `x y z`, `X [nm];Y [nm];Height [nm]`.
module m_column_names
   use m_kinds, only: wp
   use m_length_units, only: length_unit
   use m_number_text, only: read_real, number_none
   use m_text, only: to_text
   use m_text_lines, only: lines_t, is_comment
   use m_words, only: lower_case
   implicit none
   private
   public :: read_columns

   integer, parameter :: longest = 64                 !< of a name
   integer, parameter, public :: max_columns = 64
   integer, parameter :: longest_line = 1000
   character(len=*), parameter :: brackets = '[](){}', quotes = '''"'

   type, public :: columns_t
      integer :: line = 0                              !< line number in the file; 0: no header
      integer :: rows = 0                              !< their number, from the line before; 0: not there
      character(len=:), allocatable :: shown           !< the line as written
      character(len=longest), allocatable :: name(:)   !< in lower case, without quotes, blanks, _, - and unit
      character(len=longest), allocatable :: unit(:)   !< after the name, in brackets or after / or _; empty:
                                                       !< none
   contains
      procedure :: find
      procedure :: sentence
   end type columns_t

contains

   !> Read the header line, if the first non-empty line is one: words only, and the next line begins with a
   !> number. If `counted`, it may come second, after the number of rows.
   subroutine read_columns(bytes, lines, columns, counted)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines !< on return after that line
      type(columns_t), intent(out) :: columns
      logical, intent(in), optional :: counted
      type(lines_t) :: ahead, behind
      integer :: first, last
      logical :: are_names
      ahead = lines
      allocate (columns%name(0), columns%unit(0))
      columns%shown = ''
      if (.not. next_content(bytes, ahead, first, last)) return
      if (present(counted)) columns%rows = number_of_rows(bytes(first:last))
      if (columns%rows > 0) then
         if (.not. next_content(bytes, ahead, first, last)) return
      end if
      if (last - first >= longest_line) return
      if (.not. is_text(bytes(first:last))) return
      behind = ahead
      if (.not. begins_with_number(bytes, behind)) return
      call part(bytes(first:last), columns, are_names)
      if (.not. are_names) return
      columns%line = ahead%line
      columns%shown = trim(bytes(first:last))
      lines = ahead
   end subroutine read_columns

   !> Range of the next line that is neither empty nor a comment.
   logical function next_content(bytes, lines, first, last)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines
      integer, intent(out) :: first, last
      type(lines_t) :: words
      integer :: to
      next_content = .false.
      do while (lines%next_line(bytes))
         words = lines
         if (.not. words%next_word(bytes, first, to)) cycle
         if (is_comment(bytes(first:first))) cycle
         last = lines%last
         do while (iachar(bytes(last:last)) <= 32 .and. last > first)
            last = last - 1
         end do
         next_content = .true.
         return
      end do
   end function next_content

   !> The number in a line that has digits only; 0 for another line.
   pure integer function number_of_rows(line) result(number)
      character(len=*), intent(in) :: line
      integer :: status
      number = 0
      if (verify(line, '0123456789') > 0 .or. len(line) > 9) return
      read (line, *, iostat=status) number
   end function number_of_rows

   !> True when the line begins with a letter or a quote, and is text.
   pure logical function is_text(line)
      character(len=*), intent(in) :: line
      integer :: i
      is_text = scan(lower_case(line(1:1)), 'abcdefghijklmnopqrstuvwxyz'//quotes) == 1
      do i = 1, len(line)
         if (iachar(line(i:i)) < 32 .and. line(i:i) /= achar(9)) is_text = .false.
      end do
   end function is_text

   logical function begins_with_number(bytes, lines)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(inout) :: lines
      type(lines_t) :: words
      real(wp) :: value
      integer :: at, to, fault, first, last
      begins_with_number = .false.
      if (.not. next_content(bytes, lines, first, last)) return
      words%first = first
      words%last = last
      if (.not. words%next_word(bytes, at, to)) return
      call read_real(bytes(at:to), value, fault)
      if (fault == number_none .and. index(bytes(at:last), ',') > 0) & ! 1,5 is one number with a decimal
                                                                       ! comma
         call read_real(bytes(at:at + scan(bytes(at:last)//',', ',') - 2), value, fault)
      begins_with_number = fault /= number_none
   end function begins_with_number

   !> Split a line into names: at tabs, else at semicolons, else at commas, else at blanks not followed by a
   !> bracket.
   subroutine part(line, columns, are_names)
      character(len=*), intent(in) :: line
      type(columns_t), intent(inout) :: columns
      logical, intent(out) :: are_names !< none of them is a number
      character(len=1) :: mark
      real(wp) :: value
      integer :: from, to, fault
      mark = ' '
      if (index(line, ',') > 0) mark = ','
      if (index(line, ';') > 0) mark = ';'
      if (index(line, achar(9)) > 0) mark = achar(9)
      from = 1
      are_names = .true.
      do while (from <= len(line) .and. size(columns%name) < max_columns)
         to = from
         do while (to <= len(line))
            if (line(to:to) == mark .and. .not. goes_on(line(to:))) exit
            to = to + 1
         end do
         if (mark /= ' ' .or. to > from) then
            call add(adjustl(line(from:to - 1)), columns)
            call read_real(trim(adjustl(line(from:to - 1))), value, fault)
            if (fault /= number_none) are_names = .false.
         end if
         from = to + 1
      end do
   contains
      !> True when a unit in brackets follows the blank.
      pure logical function goes_on(rest)
         character(len=*), intent(in) :: rest
         goes_on = .false.
         if (mark /= ' ') return
         if (len_trim(rest) > 1) goes_on = scan(rest(2:2), '[({') == 1
      end function goes_on
   end subroutine part

   !> Append a column: its name and its unit.
   subroutine add(text, columns)
      character(len=*), intent(in) :: text
      type(columns_t), intent(inout) :: columns
      character(len=:), allocatable :: plain
      character(len=longest) :: name, unit
      integer :: i, at, n
      plain = ''
      do i = 1, len_trim(text)
         if (scan(text(i:i), quotes) == 0) plain = plain//text(i:i)
      end do
      unit = ''
      at = scan(plain, '[({')
      if (at > 1) then
         unit = plain(at + 1:)
         i = scan(unit, '])}')
         if (i > 0) unit = unit(:i - 1)
         plain = plain(:at - 1)
      else
         at = scan(plain, '/_ ', back=.true.)
         if (at > 1 .and. at < len(plain)) then
            if (is_unit(plain(at + 1:))) then
               unit = plain(at + 1:)
               plain = plain(:at - 1)
            end if
         end if
      end if
      plain = lower_case(plain)
      name = ''
      n = 0
      do i = 1, len(plain)
         if (scan(plain(i:i), ' _-.'//brackets) > 0 .or. n == longest) cycle
         n = n + 1
         name(n:n) = plain(i:i)
      end do
      columns%name = [character(len=longest) :: columns%name, name]
      columns%unit = [character(len=longest) :: columns%unit, adjustl(unit)]
   end subroutine add

   pure logical function is_unit(word)
      character(len=*), intent(in) :: word
      is_unit = length_unit(word) > 0.0_wp .or. &
                any(word == [character(len=7) :: 'deg', 'degrees', 'rad', 'radians'])
   end function is_unit

   !> The column with one of several names; 0: none.
   pure integer function find(self, names)
      class(columns_t), intent(in) :: self
      character(len=*), intent(in) :: names(:)
      integer :: n
      find = 0
      do n = 1, size(self%name)
         if (any(names == self%name(n))) then
            find = n
            return
         end if
      end do
   end function find

   !> Message that the names are not those expected.
   function sentence(self, allowed) result(text)
      class(columns_t), intent(in) :: self
      character(len=*), intent(in) :: allowed
      character(len=:), allocatable :: text
      text = 'line '//to_text(self%line)//': names the columns '''//self%shown(:min(80, len(self%shown)))// &
             '''; allowed: '//allowed
   end function sentence

end module m_column_names
