!> The text of a scene as groups, variables and raw values, each with its position. Their meaning is not
!> interpreted here.
!>
!> `&group name = value, value ... /` with ! comments, texts in single or double quotes (a quote inside is
!> doubled), repeat counts (3*0.0), commas or blanks between values, a group over several lines or several on
!> one. &end ends a group too.
module m_namelist_text
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_number_text, only: read_integer
   use m_text, only: to_text
   use m_namelist_cursor, only: cursor_t, is_name, is_plain, quotes, word_ends
   use m_namelist_group, only: group_t, entry_t, value_t, abbreviated
   use m_words, only: lower_case
   implicit none
   private

   integer, parameter :: max_entries = 1000    !< variables in a group
   integer, parameter :: max_repeats = 1000000 !< of a value; the limit for variables with repeats is this or
                                                !< the length of their text
   character(len=*), parameter :: brackets = '()%'
   character(len=*), parameter :: index_sentence = ': an index is not allowed; give all values at once, '// &
      'as name=value,value,value'

   !> All groups of a text, in its order.
   type, public :: namelist_text_t
      type(group_t), allocatable :: groups(:)
   contains
      procedure :: parse
      procedure :: count_groups
      procedure :: find_group
      procedure :: place
      procedure :: line_of
   end type namelist_text_t

contains

   !> Parse the groups of a text. An error names the line, and the group and variable if there is one.
   subroutine parse(self, text, error)
      class(namelist_text_t), intent(out) :: self
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      type(cursor_t) :: cursor
      type(group_t), allocatable :: larger(:)
      integer :: count
      allocate (self%groups(0))
      call refuse_control_characters(text, error)
      if (.not. error%happened()) call refuse_other_encodings(text, error)
      if (error%happened()) return
      cursor%text = text
      ! skip the byte order mark of some editors
      if (index(text, char(239)//char(187)//char(191)) == 1) cursor%at = 4
      count = 0
      deallocate (self%groups)
      allocate (self%groups(8))
      do
         call cursor%skip()
         if (cursor%at > len(text)) exit
         if (count == size(self%groups)) then
            allocate (larger(2*count))
            larger(:count) = self%groups
            call move_alloc(larger, self%groups)
         end if
         count = count + 1
         call parse_group(cursor, self%groups(count), error)
         if (error%happened()) exit
      end do
      self%groups = self%groups(:count)
   end subroutine parse

   !> Besides printable characters only blanks, tabs and line ends are allowed.
   subroutine refuse_control_characters(text, error)
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      integer :: i, line, code
      line = 1
      do i = 1, len(text)
         code = ichar(text(i:i))
         if (code == 10) line = line + 1
         if ((code >= 32 .and. code /= 127) .or. code == 9 .or. code == 10) cycle
         if (code == 13 .and. i < len(text)) then
            if (text(i + 1:i + 1) == achar(10)) cycle
         end if
         call fail(error, exit_input, 'line '//to_text(line)//': byte '//to_text(code)// &
                   ' is not text; a scene is a plain text file')
         return
      end do
   end subroutine refuse_control_characters

   !> A scene is UTF-8: a byte above 127 begins a character of two to four bytes, whose other bytes are 128 to
   !> 191.
   subroutine refuse_other_encodings(text, error)
      character(len=*), intent(in) :: text
      type(error_t), intent(inout) :: error
      integer :: code, i, line, more
      line = 1
      more = 0
      do i = 1, len(text)
         code = ichar(text(i:i))
         if (code >= 128 .and. code < 192 .and. more > 0) then
            more = more - 1
         else if (more > 0 .or. (code >= 128 .and. code < 194) .or. code > 244) then
            exit
         else if (code >= 194) then
            more = merge(1, merge(2, 3, code < 240), code < 224)
         end if
         if (code == 10) line = line + 1
      end do
      if (i > len(text) .and. more == 0) return
      call fail(error, exit_input, 'line '//to_text(line)// &
                ': a character is not UTF-8; save the scene as UTF-8')
   end subroutine refuse_other_encodings

   !> The group that begins at the cursor.
   subroutine parse_group(cursor, group, error)
      type(cursor_t), intent(inout) :: cursor
      type(group_t), intent(out) :: group
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: word
      type(entry_t), allocatable :: entries(:)
      integer :: count
      group%line = cursor%line
      group%name = ''
      allocate (group%entries(0))
      if (cursor%next() /= '&') then
         word = cursor%text_to_line_end()
         call fail(error, exit_input, 'line '//to_text(cursor%line)//': text outside a group: '// &
                   abbreviated(word)//'; allowed: comments behind !'//slash_in_a_unit(cursor))
         return
      end if
      cursor%at = cursor%at + 1
      call cursor%read_word(word)
      group%name = lower_case(word)
      if (.not. is_name(group%name)) then
         call fail(error, exit_input, 'line '//to_text(cursor%line)// &
                   ': & must be followed by the name of a group')
         return
      end if
      allocate (entries(max_entries))
      count = 0
      do
         call cursor%skip()
         if (group_ends(cursor, group, error)) exit
         if (count == max_entries) call fail(error, exit_input, 'line '//to_text(cursor%line)//', &'// &
                                              group%name// &
                                              ': more than '//to_text(max_entries)//' variables')
         if (error%happened()) exit
         call parse_entry(cursor, group, entries(count + 1), error)
         if (error%happened()) exit
         call refuse_twice(group, entries(:count), entries(count + 1), error)
         if (error%happened()) exit
         count = count + 1
      end do
      group%entries = entries(:count)
   end subroutine parse_group

   !> Hint on the meaning of / where text follows immediately after the / that ended a group, as in 20 m/s.
   pure function slash_in_a_unit(cursor) result(hint)
      type(cursor_t), intent(in) :: cursor
      character(len=:), allocatable :: hint
      hint = ''
      if (cursor%at < 2) return
      if (cursor%text(cursor%at - 1:cursor%at - 1) == '/') &
         hint = '. A / ends a group, also in m/s: units are not written, all is in SI'
   end function slash_in_a_unit

   !> True when the group ends here; skips its end.
   logical function group_ends(cursor, group, error)
      type(cursor_t), intent(inout) :: cursor
      type(group_t), intent(in) :: group
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: word
      group_ends = .true.
      select case (cursor%next())
      case ('/')
         cursor%at = cursor%at + 1
      case ('&')
         cursor%at = cursor%at + 1
         call cursor%read_word(word)
         if (lower_case(word) == 'end') return
         call fail(error, exit_input, 'line '//to_text(group%line)//', &'//group%name// &
                   ': not closed before line '//to_text(cursor%line)//'; a group ends with /')
      case ('')
         call fail(error, exit_input, 'line '//to_text(group%line)//', &'//group%name// &
                   ': not closed; a group ends with /')
      case default
         group_ends = .false.
      end select
   end function group_ends

   subroutine refuse_twice(group, entries, new, error)
      type(group_t), intent(in) :: group
      type(entry_t), intent(in) :: entries(:), new
      type(error_t), intent(inout) :: error
      integer :: i
      do i = 1, size(entries)
         if (entries(i)%name /= new%name) cycle
         call fail(error, exit_input, 'line '//to_text(new%line)//', &'//group%name//' '//new%name//'='// &
                   new%shown//': given twice; first on line '//to_text(entries(i)%line))
      end do
   end subroutine refuse_twice

   !> `name = values` at the cursor.
   subroutine parse_entry(cursor, group, new, error)
      type(cursor_t), intent(inout) :: cursor
      type(group_t), intent(in) :: group
      type(entry_t), intent(out) :: new
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: word, start
      integer :: first
      new%line = cursor%line
      new%shown = ''
      allocate (new%values(0))
      start = 'line '//to_text(cursor%line)//', &'//group%name
      if (scan(cursor%next(), word_ends) > 0) then
         call fail(error, exit_input, start//': unexpected '//cursor%next()//'; a group holds name=value')
         return
      end if
      call cursor%read_word(word)
      new%name = lower_case(word)
      if (scan(word, brackets) > 0) call fail(error, exit_input, start//' '//abbreviated(word)// &
                                              index_sentence)
      if (.not. is_plain(word)) call fail(error, exit_input, start// &
                                          ': only plain letters may stand outside quotes')
      if (.not. is_name(new%name)) then
         call fail(error, exit_input, start//': '//abbreviated(word)// &
                   ' is not the name of a variable; a group holds name=value')
      end if
      if (error%happened()) return
      call cursor%skip()
      if (cursor%next() /= '=') then
         call fail(error, exit_input, start//' '//abbreviated(word)// &
                   ': no = follows; a group holds name=value')
         return
      end if
      cursor%at = cursor%at + 1
      first = cursor%at
      call parse_values(cursor, new, start//' '//abbreviated(new%name), error)
      new%source = cursor%text(first:cursor%at - 1)
   end subroutine parse_entry

   !> The values after an =, up to the next name or the end of the group. Positions count from the =.
   subroutine parse_values(cursor, new, start, error)
      type(cursor_t), intent(inout) :: cursor
      type(entry_t), intent(inout) :: new
      character(len=*), intent(in) :: start
      type(error_t), intent(inout) :: error
      type(value_t), allocatable :: values(:)
      integer :: count, origin, stop_at, stop_line
      logical :: wanted
      allocate (values(4))
      count = 0
      origin = cursor%at - 1
      wanted = .true.
      do
         stop_at = cursor%at
         stop_line = cursor%line
         call cursor%skip()
         select case (cursor%next())
         case ('/', '&', '')
            exit
         case (',')
            if (wanted) call fail(error, exit_input, start//': a value is missing before a comma')
            wanted = .true.
            cursor%at = cursor%at + 1
         case ('=')
            call fail(error, exit_input, start//': unexpected =')
         case default
            if (cursor%name_follows()) exit
            call parse_value(cursor, values, count, origin, start, new%shown, error)
            wanted = .false.
         end select
         if (error%happened()) return
      end do
      cursor%at = stop_at
      cursor%line = stop_line
      if (count == 0) call fail(error, exit_input, start//': no value; write name=value')
      new%values = values(:count)
   end subroutine parse_values

   !> One value with its repeat count, if any.
   subroutine parse_value(cursor, values, count, origin, start, shown, error)
      type(cursor_t), intent(inout) :: cursor
      type(value_t), allocatable, intent(inout) :: values(:)
      integer, intent(inout) :: count
      integer, intent(in) :: origin
      character(len=*), intent(in) :: start
      character(len=:), allocatable, intent(inout) :: shown
      type(error_t), intent(inout) :: error
      type(value_t), allocatable :: larger(:)
      type(value_t) :: new
      character(len=:), allocatable :: word
      integer :: repeats, star, begin
      logical :: good
      begin = cursor%at
      repeats = 1
      call cursor%read_word(word)
      if (scan(word, brackets) > 0) call fail(error, exit_input, start//'='//abbreviated(word)// &
                                              index_sentence)
      if (.not. is_plain(word)) call fail(error, exit_input, start// &
                                          ': only plain letters may stand outside quotes')
      star = index(word, '*')
      if (star > 1) then
         call read_integer(word(:star - 1), repeats, good)
         if (.not. good .or. repeats < 1 .or. repeats > max_repeats) then
            call fail(error, exit_input, start//'='//abbreviated(word)// &
                      ': the repeat count must be between 1 and '//to_text(max_repeats))
         end if
      end if
      new%first = begin + star - origin
      new%last = cursor%at - 1 - origin
      if (len(word) == star) then
         new%quoted = scan(cursor%next(), quotes) > 0 .and. cursor%next() /= ''
         if (new%quoted) call read_quoted(cursor, origin, new, start, error)
         if (.not. new%quoted) call fail(error, exit_input, start//'='//word// &
                                         ': a value is missing after the repeat count')
      end if
      if (error%happened()) return
      if (len(shown) > 0) shown = shown//','
      shown = abbreviated(shown//cursor%text(begin:cursor%at - 1))
      if (count + repeats > size(values)) then
         allocate (larger(2*(count + repeats)))
         larger(:count) = values(:count)
         call move_alloc(larger, values)
      end if
      values(count + 1:count + repeats) = new
      count = count + repeats
      if (count > max(max_repeats, cursor%at - origin)) & ! variables without repeats have no limit
         call fail(error, exit_input, start//': more than '//to_text(max_repeats)// &
                   ' values by repeat counts')
   end subroutine parse_value

   !> A text in quotes at the cursor, a quote inside doubled.
   subroutine read_quoted(cursor, origin, new, start, error)
      type(cursor_t), intent(inout) :: cursor
      integer, intent(in) :: origin
      type(value_t), intent(inout) :: new
      character(len=*), intent(in) :: start
      type(error_t), intent(inout) :: error
      character(len=1) :: quote
      quote = cursor%text(cursor%at:cursor%at)
      new%first = cursor%at + 1 - origin
      do
         cursor%at = cursor%at + 1
         if (cursor%at > len(cursor%text)) exit
         if (cursor%text(cursor%at:cursor%at) == achar(10)) exit
         if (cursor%text(cursor%at:cursor%at) /= quote) cycle
         cursor%at = cursor%at + 1
         if (cursor%next() == quote) cycle
         new%last = cursor%at - 2 - origin
         return
      end do
      call fail(error, exit_input, start//': quote not closed on line '//to_text(cursor%line))
   end subroutine read_quoted

   pure integer function count_groups(self, name) result(count)
      class(namelist_text_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: i
      count = 0
      do i = 1, size(self%groups)
         if (self%groups(i)%name == name) count = count + 1
      end do
   end function count_groups

   !> Index of the n-th group of a name; 0 when there is none.
   pure integer function find_group(self, name, number) result(found)
      class(namelist_text_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: number
      integer :: count
      count = 0
      do found = 1, size(self%groups)
         if (self%groups(found)%name == name) count = count + 1
         if (count == number) return
      end do
      found = 0
   end function find_group

   !> As entry_place, of the n-th group of a name.
   function place(self, name, number, variable) result(text)
      class(namelist_text_t), intent(in) :: self
      character(len=*), intent(in) :: name, variable
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      text = self%groups(self%find_group(name, number))%entry_place(variable)
   end function place

   !> `line 7`, where the n-th group of a name begins.
   function line_of(self, name, number) result(text)
      class(namelist_text_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      text = 'line '//to_text(self%groups(self%find_group(name, number))%line)
   end function line_of

end module m_namelist_text
