!> One group of a scene's text: its variables, their raw values and positions.
module m_namelist_group
   use m_text, only: to_text
   implicit none
   private
   public :: abbreviated

   integer, parameter :: longest_shown = 60     !< characters of a value quoted in a message

   !> Position of a value in the source of its entry, without quotes.
   type, public :: value_t
      integer :: first = 1, last = 0
      logical :: quoted = .false.
   end type value_t

   !> One variable of a group and its raw values.
   type, public :: entry_t
      character(len=:), allocatable :: name      !< lower case
      integer :: line = 0
      character(len=:), allocatable :: source    !< of all its values
      type(value_t), allocatable :: values(:)    !< repeats expanded
      character(len=:), allocatable :: shown     !< values as quoted in messages
   contains
      procedure :: value_text
   end type entry_t

   !> One group.
   type, public :: group_t
      character(len=:), allocatable :: name      !< lower case
      integer :: line = 0
      type(entry_t), allocatable :: entries(:)
   contains
      procedure :: find_entry
      procedure :: entry_place
   end type group_t

contains

   !> At most `longest_shown` characters of a text, so that a message stays one line.
   pure function abbreviated(text) result(short)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: short
      integer :: last
      short = text
      if (len(text) <= longest_shown) return
      last = longest_shown - 3
      do while (last > 1 .and. ichar(text(last + 1:last + 1)) >= 128 &
                .and. ichar(text(last + 1:last + 1)) < 192)
         last = last - 1 ! not within a UTF-8 character
      end do
      short = text(:last)//'...'
   end function abbreviated

   !> A value without its quotes, doubled quotes inside made single.
   function value_text(self, i) result(text)
      class(entry_t), intent(in) :: self
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      character(len=1) :: quote
      integer :: at
      text = self%source(self%values(i)%first:self%values(i)%last)
      if (.not. self%values(i)%quoted) return
      quote = self%source(self%values(i)%first - 1:self%values(i)%first - 1)
      at = 1
      do while (at < len(text))
         if (text(at:at) == quote) text = text(:at)//text(at + 2:)
         at = at + 1
      end do
   end function value_text

   !> Index of a variable in the group; 0 when it is not given.
   pure integer function find_entry(self, name) result(found)
      class(group_t), intent(in) :: self
      character(len=*), intent(in) :: name
      do found = size(self%entries), 1, -1
         if (self%entries(found)%name == name) exit
      end do
   end function find_entry

   !> `line 7, &material young=-70e9`; if the variable is not given, without value and with the line of the
   !> group.
   function entry_place(self, name) result(text)
      class(group_t), intent(in) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      integer :: found
      found = self%find_entry(name)
      if (found > 0) then
         text = 'line '//to_text(self%entries(found)%line)//', &'//self%name//' '//abbreviated(name)//'='// &
                self%entries(found)%shown
      else
         text = 'line '//to_text(self%line)//', &'//self%name//' '//name
      end if
   end function entry_place

end module m_namelist_group
