!> Reading of users' texts, line by line and word by word. Words are separated by blanks, tabs, commas and
!> semicolons; trailing characters of editors and instruments (NUL, Ctrl-Z) count as blanks.
module m_text_lines
   use m_kinds, only: wp
   use m_number_text, only: read_real, number_good, number_infinite, find_decimal_comma
   use m_text, only: to_text
   implicit none
   private
   public :: with_decimal_points, read_rows, is_comment

   character(len=*), parameter :: blanks = ' ,;'//achar(9)//achar(13)//achar(0)//achar(26)
   character(len=*), parameter, public :: comments = '#!%'
   character(len=*), parameter :: byte_order = char(239)//char(187)//char(191) !< of UTF-8
   integer, parameter :: first_room = 4096 !< numbers

   type, public :: lines_t
      integer :: at = 1     !< beginning of the next line
      integer :: first = 1, last = 0 !< of the present line, without its end
      integer :: line = 0   !< its number
      logical :: joins = .false. !< a line that ends with \ continues in the next one
   contains
      procedure :: next_line
      procedure :: next_word
   end type lines_t

   !> The numbers of a text, row by row.
   type, public :: rows_t
      real(wp), allocatable :: value(:)
      integer, allocatable :: width(:)         !< numbers of each row
      integer, allocatable :: line(:)          !< and its number in the file
      character(len=:), allocatable :: header  !< comments before the first row, with their line ends
   end type rows_t

contains

   !> True for a letter that begins a comment, up to the end of its line.
   pure logical function is_comment(letter)
      character(len=1), intent(in) :: letter
      is_comment = index(comments, letter) > 0
   end function is_comment

   !> Advance to the next line; false if there is none.
   logical function next_line(self, bytes)
      class(lines_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      integer :: length, last
      if (self%at == 1 .and. index(bytes, byte_order) == 1) self%at = 1 + len(byte_order)
      next_line = self%at <= len(bytes)
      if (.not. next_line) return
      self%first = self%at
      do
         self%line = self%line + 1
         length = index(bytes(self%at:), new_line('a')) - 1
         if (length < 0) length = len(bytes) - self%at + 1
         self%last = self%at + length - 1
         self%at = self%at + length + 1
         if (.not. self%joins .or. self%at > len(bytes)) exit
         last = self%first - 1 + verify(bytes(self%first:self%last), achar(13)//' ', back=.true.)
         if (last < self%first) exit
         if (bytes(last:last) /= '\') exit
      end do
   end function next_line

   !> Advance to the next word of the line.
   logical function next_word(self, bytes, at, to)
      class(lines_t), intent(inout) :: self
      character(len=*), intent(in) :: bytes
      integer, intent(out) :: at, to !< its first and last byte
      at = self%first
      do while (at <= self%last)
         if (.not. is_blank(bytes(at:at), self%joins)) exit
         at = at + 1
      end do
      next_word = at <= self%last
      to = at - 1
      do while (to < self%last)
         if (is_blank(bytes(to + 1:to + 1), self%joins)) exit
         to = to + 1
      end do
      self%first = to + 1
   end function next_word

   pure logical function is_blank(letter, joins)
      character(len=1), intent(in) :: letter
      logical, intent(in) :: joins
      is_blank = index(blanks, letter) > 0
      if (joins .and. .not. is_blank) is_blank = letter == '\' .or. letter == achar(10)
   end function is_blank

   !> Replace decimal commas by points, if the first line of numbers has them: then blanks, tabs or semicolons
   !> separate the numbers. `fault`: the text has both, or it is ambiguous.
   subroutine with_decimal_points(bytes, fault)
      character(len=:), allocatable, intent(inout) :: bytes
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      integer :: at, to, i, content
      logical :: turned
      turned = .false.
      do while (lines%next_line(bytes))
         content = scan(bytes(lines%first:lines%last)//'#', comments) - 1
         associate (first => lines%first, last => lines%first + content - 1)
            if (index(bytes(first:last), ',') == 0) cycle
            if (scan(bytes(first:last), '0123456789') == 0) cycle ! column names
            call find_decimal_comma(bytes(first:last), at, to)
            if (at == 0 .and. .not. turned) return
            if (at == 0 .or. index(bytes(first:last), '.') > 0) then
               fault = 'line '//to_text(lines%line)//' has commas that are no decimal ones, or points '// &
                       'too, and others above have decimal commas; allowed: numbers of one kind'
               return
            end if
            turned = .true.
            do i = first, last
               if (bytes(i:i) == ',') bytes(i:i) = '.'
            end do
         end associate
      end do
   end subroutine with_decimal_points

   !> All numbers of a text, row by row; #, ! or % begins a comment.
   subroutine read_rows(bytes, from, rows, fault)
      character(len=*), intent(in) :: bytes
      type(lines_t), intent(in) :: from !< earlier lines have been read
      type(rows_t), intent(out) :: rows
      character(len=:), allocatable, intent(inout) :: fault
      type(lines_t) :: lines
      integer :: at, to, status, values, count, in_row
      lines = from
      rows%header = ''
      allocate (rows%value(first_room), rows%width(first_room), rows%line(first_room))
      values = 0
      count = 0
      do while (lines%next_line(bytes))
         in_row = 0
         do while (lines%next_word(bytes, at, to))
            if (is_comment(bytes(at:at))) then
               if (count == 0) rows%header = rows%header//bytes(at:lines%last)//new_line('a')
               exit
            end if
            if (values == size(rows%value)) call lengthen(rows%value)
            values = values + 1
            in_row = in_row + 1
            call read_real(bytes(at:to), rows%value(values), status)
            if (status == number_good) cycle
            fault = 'line '//to_text(lines%line)//': '''//bytes(at:min(to, at + 19))//''' is no number'
            if (status == number_infinite) fault = 'line '//to_text(lines%line)//': '''// &
               bytes(at:min(to, at + 19))//''' is no finite number; fill it by its neighbours'
            return
         end do
         if (in_row == 0) cycle
         if (count == size(rows%width)) then
            rows%width = [rows%width, rows%width]
            rows%line = [rows%line, rows%line]
         end if
         count = count + 1
         rows%width(count) = in_row
         rows%line(count) = lines%line
      end do
      rows%value = rows%value(:values)
      rows%width = rows%width(:count)
      rows%line = rows%line(:count)
   end subroutine read_rows

   pure subroutine lengthen(list)
      real(wp), allocatable, intent(inout) :: list(:)
      real(wp), allocatable :: more(:)
      allocate (more(2*size(list)))
      more(:size(list)) = list
      call move_alloc(more, list)
   end subroutine lengthen

end module m_text_lines
