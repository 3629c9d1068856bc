!> The figures of a plan or of a run, for programs: a JSON object of numbers, texts and lists of objects.
module m_figures
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_text, only: exact_text
   use m_communicator, only: communicator_t
   use m_part_file, only: publish_part
   use m_text_file, only: text_file_t
   implicit none
   private

   type, public :: figures_t
      character(len=:), allocatable, private :: members
      character(len=:), allocatable, private :: list, items !< the list under construction: its name, objects
   contains
      procedure :: number
      procedure :: words
      procedure :: fact
      procedure :: item
      procedure :: write => write_figures
   end type figures_t

contains

   subroutine number(self, name, value)
      class(figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name !< with the unit: time_s
      real(wp), intent(in) :: value
      call add(self, name, exact_text(value))
   end subroutine number

   subroutine words(self, name, text)
      class(figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name, text
      call add(self, name, '"'//escaped(text)//'"')
   end subroutine words

   !> `name=value`: a number where the value is one, else a text.
   subroutine fact(self, note)
      class(figures_t), intent(inout) :: self
      character(len=*), intent(in) :: note
      real(wp) :: value
      integer :: equals, status
      equals = index(note, '=')
      status = 1
      if (verify(trim(note(equals + 1:)), '+-.0123456789eE') == 0) &
         read (note(equals + 1:), *, iostat=status) value
      if (status == 0) call self%number(note(:equals - 1), value)
      if (status /= 0) call self%words(note(:equals - 1), trim(note(equals + 1:)))
   end subroutine fact

   !> Add an object to the list of this name, which is closed by the next list or by writing.
   subroutine item(self, name, figures)
      class(figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(figures_t), intent(in) :: figures
      if (allocated(self%list)) then
         if (self%list /= name) call end_list(self)
      end if
      if (.not. allocated(self%list)) then
         self%list = name
         self%items = ''
      else
         self%items = self%items//','
      end if
      self%items = self%items//new_line('a')//'  {'//figures%members//'}'
   end subroutine item

   subroutine end_list(self)
      class(figures_t), intent(inout) :: self
      if (.not. allocated(self%list)) return
      call add(self, self%list, '['//self%items//']')
      deallocate (self%list, self%items)
   end subroutine end_list

   subroutine add(self, name, value)
      class(figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable :: before
      before = ''
      if (allocated(self%members)) before = self%members//','//new_line('a')
      self%members = before//'  "'//name//'": '//value
   end subroutine add

   !> Escaped for a JSON string.
   pure function escaped(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: i
      safe = ''
      do i = 1, len(text)
         select case (text(i:i))
         case ('"', '\'); safe = safe//'\'//text(i:i)
         case (achar(0):achar(31)); safe = safe//' '
         case default; safe = safe//text(i:i)
         end select
      end do
   end function escaped

   !> Collective: rank 0 writes the file.
   subroutine write_figures(self, communicator, path, error)
      class(figures_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      type(text_file_t) :: file
      call end_list(self)
      if (communicator%is_root()) then
         call file%open(path, error)
         if (.not. error%happened()) call file%put('{', error)
         if (.not. error%happened()) call file%put(self%members, error)
         if (.not. error%happened()) call file%put('}', error)
         if (.not. error%happened()) call file%close(error)
         if (.not. error%happened()) call publish_part(path, error)
      end if
      call communicator%agree(error)
   end subroutine write_figures

end module m_figures
