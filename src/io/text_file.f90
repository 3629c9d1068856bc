!> Text files through the C library. The Fortran library reports success where a full disk has taken nothing (libgfortran 12: write,
!> flush and close alike), so that files would be torn without a word; here every failure is an error.
module m_text_file
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_long, c_size_t, c_ptr, c_null_char, c_null_ptr, c_associated
   use m_kinds, only: i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_filesystem, only: system_reason
   use m_part_file, only: part_name
   implicit none
   private

   !> A text file being written under the name of its part. Errors name `path` and tell the system's reason.
   type, public :: text_file_t
      private
      character(len=:), allocatable :: path
      type(c_ptr) :: stream = c_null_ptr
   contains
      procedure :: open => open_file
      procedure :: put
      procedure :: flush => flush_file
      procedure :: take_back
      procedure :: close => close_file
      procedure, private :: complain
   end type text_file_t

   character(len=1), parameter :: newline = achar(10)
   integer(c_int), parameter :: from_end = 2

   interface
      type(c_ptr) function c_fopen(path, mode) bind(c, name='fopen')
         import :: c_ptr, c_char
         character(kind=c_char), intent(in) :: path(*), mode(*)
      end function c_fopen
      integer(c_size_t) function c_fwrite(bytes, size, count, stream) bind(c, name='fwrite')
         import :: c_size_t, c_char, c_ptr
         character(kind=c_char), intent(in) :: bytes(*)
         integer(c_size_t), value :: size, count
         type(c_ptr), value :: stream
      end function c_fwrite
      integer(c_int) function c_fflush(stream) bind(c, name='fflush')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fflush
      integer(c_int) function c_fclose(stream) bind(c, name='fclose')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fclose
      integer(c_int) function c_fseek(stream, offset, whence) bind(c, name='fseek')
         import :: c_int, c_long, c_ptr
         type(c_ptr), value :: stream
         integer(c_long), value :: offset
         integer(c_int), value :: whence
      end function c_fseek
      integer(c_long) function c_ftell(stream) bind(c, name='ftell')
         import :: c_long, c_ptr
         type(c_ptr), value :: stream
      end function c_ftell
      integer(c_int) function c_fileno(stream) bind(c, name='fileno')
         import :: c_int, c_ptr
         type(c_ptr), value :: stream
      end function c_fileno
      integer(c_int) function c_ftruncate(descriptor, length) bind(c, name='ftruncate')
         import :: c_int, c_long
         integer(c_int), value :: descriptor
         integer(c_long), value :: length
      end function c_ftruncate
   end interface

contains

   !> Begin the part of `path`, empty.
   subroutine open_file(self, path, error)
      class(text_file_t), intent(out) :: self
      character(len=*), intent(in) :: path
      type(error_t), intent(inout) :: error
      self%path = path
      self%stream = c_fopen(part_name(path)//c_null_char, 'w'//c_null_char)
      if (.not. c_associated(self%stream)) call self%complain(error)
   end subroutine open_file

   !> Add a line, which may hold several. It may get to the disk later.
   subroutine put(self, line, error)
      class(text_file_t), intent(in) :: self
      character(len=*), intent(in) :: line
      type(error_t), intent(inout) :: error
      integer(c_size_t) :: length
      length = len(line, c_size_t) + 1_c_size_t
      if (c_fwrite(line//newline, 1_c_size_t, length, self%stream) /= length) call self%complain(error)
   end subroutine put

   !> Hand to the system what has been put.
   subroutine flush_file(self, error)
      class(text_file_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      if (c_fflush(self%stream) /= 0) call self%complain(error)
   end subroutine flush_file

   !> Remove so many bytes at the end again.
   subroutine take_back(self, bytes, error)
      class(text_file_t), intent(in) :: self
      integer(i8), intent(in) :: bytes
      type(error_t), intent(inout) :: error
      logical :: ok
      ok = c_fflush(self%stream) == 0
      if (ok) ok = c_ftruncate(c_fileno(self%stream), c_ftell(self%stream) - int(bytes, c_long)) == 0
      if (ok) ok = c_fseek(self%stream, 0_c_long, from_end) == 0
      if (.not. ok) call self%complain(error)
   end subroutine take_back

   !> End the file, which keeps the name of its part.
   subroutine close_file(self, error)
      class(text_file_t), intent(inout) :: self
      type(error_t), intent(inout) :: error
      integer(c_int) :: status
      status = c_fclose(self%stream)
      self%stream = c_null_ptr
      if (status /= 0) call self%complain(error)
   end subroutine close_file

   !> What the system says of the call before.
   subroutine complain(self, error)
      class(text_file_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      call fail(error, exit_files, 'cannot write '//self%path//': '//system_reason())
   end subroutine complain

end module m_text_file
