!> The cursor in a scene's text, and the words and names that follow it.
module m_namelist_cursor
   implicit none
   private
   public :: is_plain, is_name

   character(len=*), parameter, public :: quotes = '''"'
   character(len=*), parameter :: blanks = ' '//achar(9)//achar(10)//achar(13)
   character(len=*), parameter, public :: word_ends = blanks//quotes//',=/!&'

   !> Position of the parser.
   type, public :: cursor_t
      character(len=:), allocatable :: text
      integer :: at = 1
      integer :: line = 1
   contains
      procedure :: next
      procedure :: skip
      procedure :: read_word
      procedure :: name_follows
      procedure :: text_to_line_end
   end type cursor_t

contains

   !> True when the word at the cursor is the name of the next variable: an = follows it.
   logical function name_follows(cursor)
      class(cursor_t), intent(inout) :: cursor !< unchanged on return
      integer :: at, length, line
      name_follows = .false.
      length = scan(cursor%text(cursor%at:), word_ends) - 1
      if (length <= 0) return
      at = cursor%at
      line = cursor%line
      cursor%at = at + length
      call cursor%skip()
      name_follows = cursor%next() == '='
      cursor%at = at
      cursor%line = line
   end function name_follows

   !> True when all characters are ASCII.
   pure logical function is_plain(word)
      character(len=*), intent(in) :: word
      integer :: i
      is_plain = all([(ichar(word(i:i)) < 128, i=1, len(word))])
   end function is_plain

   !> Letters, digits and _, beginning with a letter.
   pure logical function is_name(word)
      character(len=*), intent(in) :: word
      is_name = .false.
      if (len(word) == 0 .or. len(word) > 64) return
      is_name = verify(word, 'abcdefghijklmnopqrstuvwxyz0123456789_') == 0 &
                .and. verify(word(1:1), '0123456789_') == 1
   end function is_name

   function text_to_line_end(cursor) result(text)
      class(cursor_t), intent(in) :: cursor
      character(len=:), allocatable :: text
      integer :: length
      length = scan(cursor%text(cursor%at:), achar(10)//achar(13)) - 1
      if (length < 0) length = len(cursor%text) - cursor%at + 1
      text = trim(cursor%text(cursor%at:cursor%at + length - 1))
   end function text_to_line_end

   !> The character at the cursor; none at the end.
   pure function next(self)
      class(cursor_t), intent(in) :: self
      character(len=:), allocatable :: next
      next = ''
      if (self%at <= len(self%text)) next = self%text(self%at:self%at)
   end function next

   !> Skip blanks, line ends and comments.
   subroutine skip(self)
      class(cursor_t), intent(inout) :: self
      do while (self%at <= len(self%text))
         select case (self%text(self%at:self%at))
         case (achar(10))
            self%line = self%line + 1
         case (' ', achar(9), achar(13))
            continue
         case ('!')
            do while (self%at < len(self%text))
               if (self%text(self%at + 1:self%at + 1) == achar(10)) exit
               self%at = self%at + 1
            end do
         case default
            return
         end select
         self%at = self%at + 1
      end do
   end subroutine skip

   !> Read up to a blank or sign; may be empty.
   subroutine read_word(self, word)
      class(cursor_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: word
      integer :: length
      length = 0
      if (self%at <= len(self%text)) then
         length = scan(self%text(self%at:), word_ends) - 1
         if (length < 0) length = len(self%text) - self%at + 1
      end if
      word = self%text(self%at:self%at + length - 1)
      self%at = self%at + length
   end subroutine read_word

end module m_namelist_cursor
