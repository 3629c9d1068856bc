!> Procedures of a shared library opened at run time (dlopen).
module m_dynamic_library
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_ptr, c_funptr, c_size_t, c_null_char, &
      c_null_funptr, c_null_ptr, c_associated, c_f_pointer
   implicit none
   private
   public :: find_procedure, library_of

   integer(c_int), parameter :: bind_now = 2 !< RTLD_NOW: a missing symbol is reported at once

   interface
      type(c_ptr) function c_dlopen(file, mode) bind(c, name='dlopen')
         import :: c_ptr, c_char, c_int
         character(kind=c_char), intent(in) :: file(*)
         integer(c_int), value :: mode
      end function c_dlopen
      type(c_funptr) function c_dlsym(handle, name) bind(c, name='dlsym')
         import :: c_ptr, c_funptr, c_char
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: name(*)
      end function c_dlsym
      type(c_ptr) function c_dlerror() bind(c, name='dlerror')
         import :: c_ptr
      end function c_dlerror
      integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function c_strlen
      integer(c_int) function c_dladdr(address, found) bind(c, name='dladdr')
         import :: c_funptr, c_int, c_ptr
         type(c_funptr), value :: address
         type(c_ptr), intent(out) :: found(*)
      end function c_dladdr
   end interface

contains

   !> Open a shared library, which stays open, and find a procedure in it. A file name without `/` is searched
   !> in the system's library path, others are relative to the directory in which the program was started.
   subroutine find_procedure(file, name, address, opened, complaint)
      character(len=*), intent(in) :: file, name
      type(c_funptr), intent(out) :: address  !< null if not found
      logical, intent(out) :: opened          !< the library was opened
      character(len=:), allocatable, intent(out) :: complaint !< the system's message; empty on success
      type(c_ptr) :: handle
      address = c_null_funptr
      complaint = ''
      handle = c_dlopen(file//c_null_char, bind_now)
      opened = c_associated(handle)
      if (opened) address = c_dlsym(handle, name//c_null_char)
      if (.not. c_associated(address)) complaint = last_complaint()
   end subroutine find_procedure

   !> Path of the library that contains a procedure; empty if unknown.
   function library_of(address) result(path)
      type(c_funptr), intent(in) :: address
      character(len=:), allocatable :: path
      type(c_ptr) :: found(4) ! a Dl_info: the path, and unused members
      path = ''
      found = c_null_ptr
      if (c_dladdr(address, found) == 0) return
      if (c_associated(found(1))) path = text_at(found(1))
   end function library_of

   !> The message of dlerror.
   function last_complaint() result(text)
      character(len=:), allocatable :: text
      type(c_ptr) :: words
      words = c_dlerror()
      text = 'no reason given'
      if (c_associated(words)) text = text_at(words)
   end function last_complaint

   !> A C string as text.
   function text_at(words) result(text)
      type(c_ptr), intent(in) :: words
      character(len=:), allocatable :: text
      character(kind=c_char), pointer :: letters(:)
      integer :: i
      call c_f_pointer(words, letters, [c_strlen(words)])
      text = repeat(' ', size(letters))
      do i = 1, size(letters)
         text(i:i) = letters(i)
      end do
   end function text_at

end module m_dynamic_library
