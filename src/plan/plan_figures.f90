!> The figures of a plan, for programs: a JSON object of numbers and texts.
module m_plan_figures
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_text, only: exact_text
   use m_communicator, only: communicator_t
   use m_part_file, only: publish_part
   use m_text_file, only: text_file_t
   implicit none
   private

   type, public :: plan_figures_t
      character(len=:), allocatable, private :: members
   contains
      procedure :: number
      procedure :: words
      procedure :: write => write_figures
   end type plan_figures_t

contains

   subroutine number(self, name, value)
      class(plan_figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name !< with the unit: time_s
      real(wp), intent(in) :: value
      call add(self, name, exact_text(value))
   end subroutine number

   subroutine words(self, name, text)
      class(plan_figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name, text
      call add(self, name, '"'//escaped(text)//'"')
   end subroutine words

   subroutine add(self, name, value)
      class(plan_figures_t), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable :: before
      before = ''
      if (allocated(self%members)) before = self%members//','//new_line('a')
      self%members = before//'  "'//name//'": '//value
   end subroutine add

   !> As it stands between the quotes of JSON.
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
      class(plan_figures_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      type(text_file_t) :: file
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

end module m_plan_figures
